"""What is imposed on a frictional contact in an increment, and its state at the end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.normal.contact import NormalStart
from sa_solver.rigid_modes import NORMAL, RESULTANTS
from sa_solver.traction_state import TractionState
from sa_solver.types import Array, Mask

MOTIONS = ("approach", "shift_x", "shift_y", "tilt_x", "tilt_y", "twist")
"""Names of the motions conjugate to the resultants."""


@dataclass(frozen=True, init=False)
class ContactLoad:
    """Load or motion imposed at the end of an increment, by names or as an array.

    By names it is ``P`` [N; per mm on line grids] or the ``approach`` δz [mm] since the bodies were
    apart; of ``Qx`` and ``shift_x`` δx, ``Qy`` and ``shift_y`` δy, ``Mz`` [N mm] and ``twist`` φz
    [rad] one each, the force 0 where neither is named; and of ``Mx`` and ``tilt_x`` φx, ``My`` and
    ``tilt_y`` φy one each, the tilt held at 0 where neither is named: ``Mx=0.0, My=0.0`` lets the
    bodies turn.

    As an array, ``values`` (6,) are (P, Qx, Qy, Mx, My, Mz) or, where ``motion`` (6,) says so, the
    motions (δz, δx, δy, φx, φy, φz). A moment of 0 in it lets the bodies turn.

    ``strain`` is the mismatch ε_2 - ε_1 along x of the unloaded surfaces (bulk stress). ``along``
    ``(2, nx, ny)`` [mm] is what these have moved relative to each other beside that, tractions and
    rigid motions apart. ``energy`` (2,) [N mm], if known, is what the increment dissipates in x and
    in y.

    Raises InputError for both of a pair, neither ``P`` nor ``approach``, names beside ``values``,
    or values of another number or type.

    Examples
    --------
    500 N, and then a motion of 2 µm along x while it is kept:

    >>> from sa_solver import ContactLoad
    >>> from sa_solver import ElasticPair, FrictionalContact, Grid, HalfSpace, Material
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.covering((1.0, 1.0), (32, 32))
    >>> contact = FrictionalContact(HalfSpace(grid, ElasticPair(steel, steel)), friction=0.5)
    >>> height = (grid.x**2 + grid.y**2) / 20.0
    >>> state = contact.advance(contact.apart(height), height, ContactLoad(P=500.0))
    >>> state = contact.advance(state, height, ContactLoad(P=500.0, shift_x=0.002))
    >>> print(f"Qx {state.resultants[1]:.0f} N")
    Qx 111 N
    >>> print(ContactLoad(P=500.0, shift_x=0.002).motion)
    (False, True, False, True, True, False)
    """

    values: Array
    motion: tuple[bool, ...]
    strain: float
    energy: Array | None
    along: Array | None

    def __init__(
        self,
        values: Array | None = None,
        motion: tuple[bool, ...] = (False,) * 6,
        strain: float = 0.0,
        energy: Array | None = None,
        along: Array | None = None,
        *,
        P: float | None = None,
        approach: float | None = None,
        Qx: float | None = None,
        shift_x: float | None = None,
        Qy: float | None = None,
        shift_y: float | None = None,
        Mx: float | None = None,
        tilt_x: float | None = None,
        My: float | None = None,
        tilt_y: float | None = None,
        Mz: float | None = None,
        twist: float | None = None,
    ) -> None:
        forces = P, Qx, Qy, Mx, My, Mz
        motions = approach, shift_x, shift_y, tilt_x, tilt_y, twist
        if values is None:
            values, motion = _named(forces, motions)
        elif any(value is not None for value in forces + motions):
            raise InputError("a load has values and names beside them: give one or the other")
        if np.shape(motion) != (6,):
            raise InputError(f"the motion of a load is {motion!r}: give six switches")
        checks.settle(
            self,
            values=checks.array("values of a load", values, (6,), finite=False),
            motion=tuple(map(bool, motion)),
            strain=strain,
            energy=None if energy is None else checks.array("energies", energy, (2,), finite=False),
            along=along
            if along is None
            else checks.array("motions along", along, (2, None, None), finite=False),
        )


def _named(
    forces: tuple[float | None, ...], motions: tuple[float | None, ...]
) -> tuple[Array, tuple[bool, ...]]:
    """Values and switches of a load of which some forces and motions are named."""
    values, switches = [], []
    for k, (force, motion) in enumerate(zip(forces, motions, strict=True)):
        if force is not None and motion is not None:
            raise InputError(
                f"a load has {RESULTANTS[k]} and {MOTIONS[k]}: impose one, the other follows"
            )
        if k == 0 and force is None and motion is None:
            raise InputError("a load has neither P nor approach: impose one of them")
        switches.append(motion is not None or (k in NORMAL and force is None))
        given = motion if force is None else force
        name = MOTIONS[k] if switches[k] else RESULTANTS[k]
        values.append(checks.number(name, 0.0 if given is None else given))
    return np.array(values), tuple(switches)


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
class ContactState(TractionState):
    """State of a frictional contact at the end of an increment.

    Fields: ``traction`` ``(3, nx, ny)`` ordered qx, qy, p [MPa], its ``displacement`` K t
    ``(3, nx, ny)`` [mm], ``slip`` ``(2, nx, ny)`` [mm] of the increment in cells
    pressed before or after it, ``gap`` ``(nx, ny)`` [mm],
    ``sticking`` ``(nx, ny)``. ``resultants`` (6,) and ``rigid`` (6,) are ordered as in
    :class:`ContactLoad`, of which ``strain`` and ``along`` are; ``rigid`` counts from the bodies
    apart. ``energy`` (2,) is dissipated in the increment in x and y [N mm]. ``sliding`` says that
    the whole contact slipped by its energy: then the Q in ``resultants`` follows, and need not be
    the one given. ``residual`` is the largest of the residuals of the problems solved; ``message``
    says what is wrong, of a state that has not ``converged`` and of a contact that reaches the
    grid's border, where cells carry the share ``border_load`` of P; else it is empty. ``cell_area``
    [mm²] is that of the grid.
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
    cell_area: float
    strain: float = 0.0
    along: Array | None = None
    sliding: bool = False
    residual: float = 0.0
    message: str = ""
    convolutions: int = 0
    border_load: float = 0.0

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
