"""Two bodies without finite elements under a cycle of forces and motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.ties import SAME, first_largest
from sa_solver.types import Array, ElasticPair, Grid, Tilt
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads
from workflow.models.checks.names import check_face_name
from workflow.models.contact import Contact, gap_on
from workflow.models.gaps import GapFunction
from workflow.models.loads import (
    COARSER,
    ContactFace,
    UncoupledSource,
    check_size,
    coarse_cells,
    nominal_face,
)
from workflow.models.uncoupled.load_table import SHIFTS, LoadTable, conflict


@dataclass(frozen=True)
class BodyPair:
    """Two bodies without finite elements, such as a ball on a flat, under a closed cycle of loads.

    Wear does not change the loads. Friction follows from motions along the face; under forces alone
    the half-space finds slip and dissipation, which takes ``method`` "full" of the contact.

    Parameters
    ----------
    gap : callable
        Returns the distance of the unloaded bodies [mm] at ``x`` ``(n, 1)`` and ``y`` ``(1, m)``.
    size : (float, float)
        Extent of the contact grid along x and y [mm], with room for the motion; a line contact uses
        the first one only.
    loads : LoadTable
        Forces and motions in every increment of the cycle.
    tilt : {"held", "free"}
        Whether the bodies keep their tilt or turn until no moment is left; a moment or a tilt among
        the loads decides about its own axis.
    line : bool
        Whether the contact extends along a line: forces are then per length.
    name : str
        Name of the contact.
    peak : int, optional
        Increment of peak load. Without it, that of the largest shear force among those of the
        largest normal force.
    remedy : str
        Advice if the contact reaches the border of its grid, for messages.

    Examples
    --------
    A ball of 10 mm under 50 N, which slides by 20 µm there and back, wears by µP · 2 s · α in a
    cycle:

    >>> import fretscale
    >>> from sa_solver import Material
    >>> from wear import EnergyLaw
    >>> ball = fretscale.BodyPair(
    ...     gap=lambda x, y: (x**2 + y**2) / (2 * 10.0),
    ...     size=(0.6, 0.6),
    ...     loads=fretscale.LoadTable.stroke(P=50.0, stroke=0.02),
    ... )
    >>> titanium, law = Material(115e3, 0.29), EnergyLaw(1e-8)
    >>> contact = fretscale.Contact((32, 32), (titanium, titanium), (law, law), friction=0.6)
    >>> worn = fretscale.WearModel(ball, contact, fretscale.Wear(cycles=5e3)).run()["interface"]
    >>> print(f"{float(worn['volume_2'][-1]):.3e} mm^3 of {0.6 * 50.0 * 0.04 * 1e-8 * 5e3:.3e}")
    6.000e-05 mm^3 of 6.000e-05
    """

    gap: GapFunction
    size: tuple[float, float]
    loads: LoadTable
    tilt: Tilt = "held"
    line: bool = False
    name: str = "interface"
    peak: int | None = None
    remedy: str = "enlarge its size, and the grid of the contact with it"

    def __post_init__(self) -> None:
        checks.choices(self, tilt=("held", "free"))
        checks.instances(self, gap=Callable, loads=LoadTable, line=bool, remedy=str)
        check_face_name(self.name)
        check_size("BodyPair.size", self.size, self.line)
        if problem := conflict(self.loads.columns):
            raise InputError(f"loads of two bodies: {': '.join(problem)}")
        if (force := self.loads["P"].min()) < 0.0:
            raise InputError(f"P = {force:g} N pulls the bodies apart: give 0 or more")
        if self.peak is not None:
            checks.places("the peak", checks.whole("peak", self.peak), len(self.loads))

    def in_parts(self, parts: int) -> BodyPair:
        """Return the bodies under the same cycle with each increment split into equal ``parts``."""
        peak = None if self.peak is None else parts * self.peak
        return replace(self, loads=self.loads.in_parts(parts), peak=peak)

    def source(self, contact: Contact) -> BodyPairSource:
        """Return the loads of the bodies with the materials and the friction of a contact.

        Raises InputError where method "normal" does not suit the loads.
        """
        if contact.method == "normal" and (wrong := self.loads.unfit_for_sliding):
            raise InputError(
                "method normal lets every cell slide by the whole motion, but the load table "
                f"{wrong}: give method full, or no more than {' and '.join(SHIFTS)} along the face"
            )
        return BodyPairSource(self, contact)


class BodyPairSource(UncoupledSource):
    """Cycle of forces and motions of two bodies.

    Loads that are not imposed are those of sliding bodies along the face, and of the unworn contact
    across it. The half-space finds the dissipation under forces alone.
    """

    def __init__(self, bodies: BodyPair, contact: Contact) -> None:
        self._bodies, self._contact, self.line = bodies, contact, bodies.line
        self._table = bodies.loads.held(bodies.tilt)
        strain = self._table.bulk_strain(contact.bodies)
        self.drive = Drive(
            self._table.is_motion, self._table.imposed, strain if strain.any() else None
        )
        self.peak = self._largest_load() if bodies.peak is None else bodies.peak
        self.slip_known = bool(self.motion.any())

    def _largest_load(self) -> int:
        """Return the increment with the largest shear force among those with the largest P."""
        heaviest, shear = self._normal_force, np.hypot(self._table["Qx"], self._table["Qy"])
        loaded = heaviest >= (1.0 - SAME) * heaviest.max()
        return first_largest(np.where(loaded, shear, -1.0))

    @cached_property
    def faces(self) -> tuple[ContactFace, ...]:
        bodies, grid = self._bodies, self._grid
        return (
            ContactFace(
                nominal_face(bodies.name, grid.size, self.line),
                grid.size,
                bodies.gap,
                coarse_cells(grid.shape[0] // COARSER, grid.shape[1] // COARSER, self.line),
                bodies.remedy,
                drive=self.drive,
            ),
        )

    def unworn(self) -> tuple[CycleLoads, ...]:
        return self._cycle(self._contact.coulomb.at(0.0))

    def worn(
        self, depths: Sequence[Array], friction: Sequence[float] | None = None
    ) -> tuple[CycleLoads, ...]:
        """Return the unworn cycle with the present friction: no structure responds to wear."""
        return self._cycle(*friction) if friction else self.unworn()

    @cached_property
    def motion(self) -> Array:
        """Imposed motion of body 2 over body 1 in each increment ``(t, 2)`` [mm]."""
        shift = np.stack([self._table[name] for name in SHIFTS], axis=1)
        return np.roll(shift, 1, axis=0) - shift

    def _cycle(self, friction: float) -> tuple[CycleLoads]:
        """Return the cycle of the only contact."""
        slip = np.repeat(self.motion[:, :, None], len(self.faces[0].face), axis=2)
        return (CycleLoads(self._loads(friction), slip),)

    def _loads(self, friction: float) -> LoadHistory:
        """Return imposed forces, with friction and dissipation where motions are imposed."""
        table, motion, P = self._table, self.motion, self._normal_force
        Qx, Qy = table["Qx"], table["Qy"]
        sliding = motion.any(axis=1) & (P > 0.0)
        if motion.any():
            length = np.hypot(motion[:, 0], motion[:, 1])[:, None]
            along = np.divide(motion, length, out=np.zeros_like(motion), where=length > 0.0)
            friction_x, friction_y = (-friction * P[:, None] * along).T
            Qx, Qy = Qx + friction_x, Qy + friction_y
        Edx, Edy = np.where(sliding, -np.stack([Qx, Qy]) * motion.T, 0.0)
        Mx, My, Mz = (table[name] for name in ("Mx", "My", "Mz"))
        return LoadHistory(P, Qx, Qy, Mx, My, Mz, Edx, Edy, sliding)

    @cached_property
    def _normal_force(self) -> Array:
        """Normal force per increment ``(t,)``; that of the unworn contact where motions press."""
        table, drive = self._table, self.drive
        if not drive.motion[0]:
            return table["P"]
        grid, zero = self._grid, np.zeros(len(table))
        contact = NormalContact(HalfSpace(grid, ElasticPair(*self._contact.bodies)))
        height = gap_on(self.faces[0], grid)
        loads = LoadHistory(
            zero, zero, zero, table["Mx"], table["My"], zero, zero, zero, sliding=zero > 0.0
        )
        pressing = (drive.pressing(loads, t) for t in range(len(table)))
        return np.array(
            [
                contact.solve(height, **imposed, start=None, compliance=None).P
                for imposed in pressing
            ]
        )

    @property
    def _grid(self) -> Grid:
        return Grid.over(self._bodies.size, self._contact.grid, self.line)
