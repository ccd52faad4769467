"""Load of a frictional contact in one increment, and its state at the end of the increment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.normal.state import NormalStart
from sa_solver.rigid_modes import NORMAL, RESULTANTS
from sa_solver.traction_state import TractionState
from sa_solver.types import Array, Mask

MOTIONS = ("approach", "shift_x", "shift_y", "tilt_x", "tilt_y", "twist")
"""Names of the motions that are conjugate to the resultants, in the same order."""


@dataclass(frozen=True, init=False)
class ContactLoad:
    """Load or motion imposed at the end of an increment, given by keywords or as an array.

    For each of the six rigid freedoms either the resultant or the motion is imposed. Forces are per
    mm on line grids. Motions count from the state in which the bodies are apart.

    Parameters
    ----------
    values
        All six values at once, instead of the keywords below: the resultants (P, Qx, Qy, Mx, My,
        Mz) or, where ``motion`` is true, the motions (δz, δx, δy, φx, φy, φz). A moment Mx or My of
        0 lets the bodies turn.
    motion
        For each of ``values``, whether it is a motion.
    strain
        Mismatch ε_2 - ε_1 along x between the unloaded surfaces, due to a bulk stress.
    energy
        Energy (2,) [N mm] that the increment dissipates along x and y, if known.
    along
        Tangential motion ``(2, nx, ny)`` [mm] of the unloaded surfaces relative to each other, in
        addition to ``strain`` and without rigid motions.
    P, approach
        Normal force [N] or approach δz [mm]; one of them is required.
    Qx, shift_x, Qy, shift_y, Mz, twist
        Shear forces [N] or shifts δx, δy [mm], and moment [N mm] or twist φz [rad]. The force or
        moment is 0 where neither of a pair is given.
    Mx, tilt_x, My, tilt_y
        Moments [N mm] or tilts φx, φy [rad]. The tilt is held at 0 where neither of a pair is
        given; ``Mx=0.0, My=0.0`` lets the bodies turn.

    Raises
    ------
    InputError
        If both of a pair are given, neither ``P`` nor ``approach``, keywords in addition to
        ``values``, or values of a wrong number or type.

    Examples
    --------
    A load of 500 N, followed by a motion of 2 µm along x under the same load:

    >>> from sa_solver import ContactLoad
    >>> from sa_solver import ElasticPair, FrictionalContact, Grid, HalfSpace, Material
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.covering((1.0, 1.0), (32, 32))
    >>> contact = FrictionalContact(HalfSpace(grid, ElasticPair(steel, steel)), friction=0.5)
    >>> height = (grid.x**2 + grid.y**2) / 20.0
    >>> state = contact.advance(contact.unloaded_state(height), height, ContactLoad(P=500.0))
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
            raise InputError(
                "a load is given by values and by keywords such as P: give one or the other"
            )
        if np.shape(motion) != (6,):
            raise InputError(f"the motion of a load is {motion!r}: give six truth values")
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
    """Return the values (6,) of a load given by keywords, and which of them are motions."""
    values, switches = [], []
    for k, (force, motion) in enumerate(zip(forces, motions, strict=True)):
        if force is not None and motion is not None:
            raise InputError(
                f"a load has both {RESULTANTS[k]} and {MOTIONS[k]}: impose one, the other follows"
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
    """Initial guess of the solver: a known state near the one sought.

    The guess affects the number of iterations but not the solution, within the tolerance. Fields
    that are not known are None.

    Attributes
    ----------
    normal
        Pressure and its displacement, of similar bodies.
    shear
        Shear ``(2, nx, ny)`` [MPa] of similar bodies.
    slipping
        Cells ``(nx, ny)`` that slip under this shear.
    motion
        Rigid motion (δx, δy) [mm] since the bodies were apart.
    together
        Shear and pressure ``(3, nx, ny)`` [MPa] of dissimilar bodies.
    """

    normal: NormalStart | None = None
    shear: Array | None = None
    slipping: Mask | None = None
    motion: Array | None = None
    together: Array | None = None

    def motion_from(self, before: ContactState) -> Array | None:
        """Return the motion (Δδx, Δδy) [mm] from ``before`` to this guess, None if unknown."""
        return None if self.motion is None else self.motion - before.rigid[1:3]


@dataclass(frozen=True)
class ContactState(TractionState):
    """State of a frictional contact at the end of an increment.

    Attributes
    ----------
    traction
        Tractions qx, qy, p ``(3, nx, ny)`` [MPa].
    displacement
        Elastic displacement K t ``(3, nx, ny)`` [mm] under these tractions.
    slip
        Slip ``(2, nx, ny)`` [mm] of the increment in cells that were in contact before or after it.
    gap
        Gap ``(nx, ny)`` [mm].
    sticking
        Cells in contact that stick ``(nx, ny)``.
    resultants, rigid
        Resultants (6,) and rigid motions (6,) since the bodies were apart, ordered as in
        :class:`ContactLoad`. Periodic contacts have no moments.
    energy
        Energy (2,) [N mm] dissipated in the increment along x and y.
    converged
        Whether all problems were solved to the tolerance.
    cell_area
        Area of a cell of the grid [mm²].
    strain, along
        Mismatch of the unloaded surfaces, as in :class:`ContactLoad`.
    sliding
        Whether the whole contact slid by a motion that follows from the given energy. The shear
        force in ``resultants`` is then a result and may differ from the imposed one.
    residual
        Largest residual of the problems solved.
    message
        What is wrong, if the state has not ``converged`` or the contact reaches the border of the
        grid; empty otherwise.
    convolutions
        Cost of the increment in convolutions.
    border_load
        Share of P that the outermost cells carry; above 0 the grid is too small.
    flattening
        Depth ``(nx, ny)`` [mm] by which the surfaces have yielded so far, None without a hardness.
    limit
        Largest shear µp ``(nx, ny)`` [MPa] where friction depends on place or pressure, else None.
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
    flattening: Array | None = None
    limit: Array | None = None

    @property
    def slipping(self) -> Mask:
        """Cells of the contact that do not stick ``(nx, ny)``."""
        slipping: Mask = (self.pressure > 0.0) & ~self.sticking
        return slipping

    @property
    def pressed(self) -> NormalStart:
        """Initial guess for a normal problem with a similar pressure."""
        return NormalStart(self.pressure, self.displacement[2])

    @property
    def as_start(self) -> ContactStart:
        """Initial guess for a search for a state near this one."""
        motion = self.rigid[1:3]
        return ContactStart(self.pressed, self.shear, self.slipping, motion, self.traction)
