"""What is imposed on a frictional contact in an increment, and its state at the end."""

from __future__ import annotations

from dataclasses import dataclass

from sa_solver.normal import NormalStart
from sa_solver.types import Array, Mask


@dataclass(frozen=True)
class ContactLoad:
    """What is imposed at the end of an increment.

    ``values`` (6,) are (P, Qx, Qy, Mx, My, Mz) [N, N mm; per mm on line grids] or, where
    ``motion`` (6,) says so, the motions (δz, δx, δy, φx, φy, φz) [mm, rad] since the bodies were
    apart. ``strain`` is the mismatch ε_2 - ε_1 along x of the unloaded surfaces (bulk stress).
    ``along`` ``(2, nx, ny)`` [mm] is what these have moved relative to each other beside that,
    tractions and rigid motions apart. ``energy`` (2,) [N mm], if known, is what the increment
    dissipates in x and in y.

    Examples
    --------
    500 N, and then a motion of 2 µm along x while it is kept:

    >>> import numpy as np
    >>> from sa_solver import ContactLoad
    >>> from sa_solver import ElasticPair, FrictionalContact, Grid, HalfSpace, Material
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.covering((1.0, 1.0), (32, 32))
    >>> contact = FrictionalContact(HalfSpace(grid, ElasticPair(steel, steel)), friction=0.5)
    >>> height = (grid.x**2 + grid.y**2) / 20.0
    >>> pressed = ContactLoad(np.array([500.0, 0, 0, 0, 0, 0]))
    >>> moved = ContactLoad(np.array([500.0, 0.002, 0, 0, 0, 0]), (False, True, *[False] * 4))
    >>> state = contact.advance(contact.apart(height), height, pressed)
    >>> state = contact.advance(state, height, moved)
    >>> print(f"Qx {state.resultants[1]:.0f} N")
    Qx 111 N
    """

    values: Array
    motion: tuple[bool, ...] = (False,) * 6
    strain: float = 0.0
    energy: Array | None = None
    along: Array | None = None


@dataclass(frozen=True)
class ContactStart:
    """Where a search may begin if somebody knows a state near the one sought.

    Its ``normal`` pressure, its ``shear`` ``(2, nx, ny)`` [MPa] with the cells ``slipping``
    ``(nx, ny)`` and the ``motion`` (δx, δy) [mm] since the bodies were apart, or of unlike bodies
    both tractions ``together`` ``(3, nx, ny)``; None of what nobody knows. What is found is the
    same within the tolerance.
    """

    normal: NormalStart | None = None
    shear: Array | None = None
    slipping: Mask | None = None
    motion: Array | None = None
    together: Array | None = None


@dataclass(frozen=True)
class ContactState:
    """State of a frictional contact at the end of an increment.

    Fields: ``traction`` ``(3, nx, ny)`` ordered qx, qy, p [MPa], its ``displacement`` K t
    ``(3, nx, ny)`` [mm], ``slip`` ``(2, nx, ny)`` [mm] of the increment in cells that are pressed
    before or after it, ``gap`` ``(nx, ny)`` [mm], ``sticking`` ``(nx, ny)``. ``resultants`` (6,)
    and ``rigid`` (6,) are ordered as in :class:`ContactLoad`, of which ``strain`` and ``along``
    are; ``rigid`` counts from the bodies apart. ``energy`` (2,) is dissipated in the increment in x
    and y [N mm]. ``sliding`` says that the whole contact slipped by its energy: then the Q in
    ``resultants`` follows, and need not be the one given. ``residual`` is the largest of the
    residuals of the problems solved; ``message`` is empty when ``converged``.
    """

    traction: Array
    displacement: Array
    slip: Array
    gap: Array
    sticking: Mask
    resultants: Array
    rigid: Array
    energy: Array
    converged: bool
    strain: float = 0.0
    along: Array | None = None
    sliding: bool = False
    residual: float = 0.0
    message: str = ""
    convolutions: int = 0
    border_load: float = 0.0

    @property
    def pressure(self) -> Array:
        """p ``(nx, ny)`` [MPa]."""
        pressure: Array = self.traction[2]
        return pressure

    @property
    def shear(self) -> Array:
        """qx, qy ``(2, nx, ny)`` [MPa]."""
        return self.traction[:2]

    @property
    def slipping(self) -> Mask:
        """Cells of the contact that do not stick ``(nx, ny)``."""
        slipping: Mask = (self.pressure > 0.0) & ~self.sticking
        return slipping

    @property
    def pressed(self) -> NormalStart:
        """To begin from in the search for pressures near this one's."""
        return NormalStart(self.pressure, self.displacement[2])

    @property
    def as_start(self) -> ContactStart:
        """To begin from in the search for a state near this one."""
        motion = self.rigid[1:3]
        return ContactStart(self.pressed, self.shear, self.slipping, motion, self.traction)
