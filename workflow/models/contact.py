"""Contacts of a model: their materials and laws, their wear settings, and one face on its grid."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from math import prod
from typing import Any, Literal, Protocol

import numpy as np

from fe_models.meshes.transfer import FaceTransfer
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.surfaces.resolution import fewest_across, is_point, peak_error, too_few_across
from sa_solver.types import Array, ElasticPair, Grid, Material
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceState
from wear.contact.link import StructureLink
from wear.contact.nodes import NodalFaceState
from wear.contact.settings import InterfaceSettings
from wear.contact.tractions import ContactFields, CycleTractions
from wear.evolution import CoulombFriction
from wear.laws import WearLaw
from wear.schedule import CoupledSettings, JumpSize, Stop
from wear.steps.implicit import ImplicitStepper, SecondOrderStepper
from wear.steps.step_errors import ErrorControl, step_errors
from wear.steps.steppers import ExplicitStepper, Stepper
from wear.steps.stepping import WearingContact, WearState
from wear.surfaces import Surfaces
from workflow.errors import TooCoarse
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.checks.limits import MOST_CELLS, MOST_JUMPS, check_count
from workflow.models.loads import ContactFace

WearStepper = Stepper[WearState, WearingContact]

MOTIONS = "auto", "follow", "neglect"
STEPS = "implicit", "second_order", "explicit"
# A run with explicit steps, a fraction of their stability limit each, is recorded in this many
# jumps: single steps are too short to record.
RECORDS = 10
LONGER_JUMPS = "give a longer jump, or none, so that an error estimate chooses it"
# A larger tolerance of the contact solver would return its first guess.
LARGEST_TOLERANCE = 1e-3


# --- settings -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Contact:
    """Materials, wear laws and friction of a contact, and how it is solved.

    Parameters
    ----------
    grid : (int, int)
        Cells along x and y over the face; one along y in a line contact.
    bodies : (Material, Material)
        Body 1 and body 2, which deform as half-spaces near the contact.
    laws : (WearLaw, WearLaw)
        Wear laws of body 1 and body 2.
    friction : float or CoulombFriction
        Coulomb's coefficient.
    method : {"normal", "full", "nodes"}
        Pressure of the half-space under the slips of the loads; pressure, shear and slip of the
        half-space; or no half-space: the nodes of the structure wear.
    link : {"corrected", "half_space"}
        Whether bodies deform as their structure does, where it is known, or as half-spaces.
    gross_slip : {"force", "energies"}
        How a face that slides as a whole finds its direction (``method`` "full"): with the shear
        force of the loads, or sharing their energy between x and y.
    tolerance : float
        Relative tolerance on equilibrium and complementarity. Where the half-space finds shear and
        slip, a hundredth of it, but not below 1e-8.

    Examples
    --------
    Titanium on titanium that wears by dissipated energy, 1e4 µm³/J:

    >>> import fretscale
    >>> from sa_solver import Material
    >>> from wear import EnergyLaw
    >>> titanium, law = Material(115e3, 0.29), EnergyLaw(1e-8)
    >>> contact = fretscale.Contact((64, 1), (titanium, titanium), (law, law), friction=0.4)
    >>> print(contact.method, contact.coulomb.at(0.0))
    normal 0.4
    """

    grid: tuple[int, int]
    bodies: tuple[Material, Material]
    laws: tuple[WearLaw, WearLaw]
    friction: float | CoulombFriction
    method: Literal["normal", "full", "nodes"] = "normal"
    link: Literal["corrected", "half_space"] = "corrected"
    gross_slip: Literal["force", "energies"] = "force"
    tolerance: float = 5e-5

    def __post_init__(self) -> None:
        checks.choices(
            self,
            method=("normal", "full", "nodes"),
            link=("corrected", "half_space"),
            gross_slip=("force", "energies"),
        )
        checks.numbers(self, "tolerance", above=0.0, most=LARGEST_TOLERANCE)
        if np.shape(self.grid) != (2,):
            raise InputError(
                f"Contact.grid is {checks.shown(self.grid)}: give two numbers of cells, 1 along y "
                "in a line contact"
            )
        cells = [checks.whole("a number of cells in Contact.grid", n, least=1) for n in self.grid]
        check_count("cells", prod(cells), MOST_CELLS, "give Contact.grid fewer")
        checks.settle(self, grid=tuple(cells))
        check_two_bodies(self.bodies)
        check_two_laws(self.laws)
        if not isinstance(self.friction, CoulombFriction):
            checks.settle(self, friction=CoulombFriction(self.friction))

    @property
    def coulomb(self) -> CoulombFriction:
        """The coefficient of friction as a function of dissipated energy."""
        assert isinstance(self.friction, CoulombFriction)
        return self.friction


@dataclass(frozen=True)
class Wear:
    """Length and steps of the wear of contacts, and when worn surfaces change their loads.

    Without ``jump`` and ``fraction`` the length of steps is chosen for an error of the depth.

    Parameters
    ----------
    cycles : float
        Length of the run in load cycles.
    steps : {"implicit", "second_order", "explicit"}
        Kind of wear steps. The first two are stable at any length, explicit ones below a limit.
    tolerance : float
        Error of the depth that steps may make: root mean square over the worn area, relative to
        the depth at the end.
    depth_tolerance : float, optional
        Such an error in mm, instead of ``tolerance``.
    jump : JumpSize
        Length of a step, if it is given.
    fraction : float, optional
        Length of explicit steps over their stability limit, if it is given.
    stop : Stop
        Depth or volume at which the run ends before its cycles are over.
    resultants : {"drift", "constant", "every"}
        When the loads are computed again with worn surfaces: after they have drifted by the share
        ``drift``, never, or after every jump.
    drift : float
        Change of the resultants that asks for new loads, relative.
    motion : {"auto", "follow", "neglect"}
        Whether to follow surfaces that move over each other within a cycle; auto: where the motion
        counts and the grid resolves it.

    Examples
    --------
    Steps as long as an error of 0.5 % of the depth allows, until 20 µm are worn:

    >>> import fretscale
    >>> wear = fretscale.Wear(cycles=1e6, tolerance=0.005, stop=fretscale.Stop(depth=0.02))
    >>> print(wear.steps, wear.automatic)
    implicit True
    """

    cycles: float
    steps: Literal["implicit", "second_order", "explicit"] = "implicit"
    tolerance: float = 0.01
    depth_tolerance: float | None = None
    jump: JumpSize = field(default_factory=JumpSize)
    fraction: float | None = None
    stop: Stop = field(default_factory=Stop)
    resultants: Literal["drift", "constant", "every"] = "drift"
    drift: float = 0.02
    motion: Literal["auto", "follow", "neglect"] = "auto"

    def __post_init__(self) -> None:
        checks.choices(self, steps=STEPS, motion=MOTIONS, resultants=("drift", "constant", "every"))
        checks.numbers(self, "cycles", above=0.0)
        checks.numbers(self, "tolerance", "depth_tolerance", "fraction", above=0.0)
        checks.numbers(self, "drift", least=0.0)
        checks.instances(self, jump=JumpSize, stop=Stop)
        if self.jump.cycles is not None:
            check_count("wear jumps", self.cycles / self.jump.cycles, MOST_JUMPS, LONGER_JUMPS)
        if self.steps == "explicit" and self.automatic:
            raise InputError(
                "Wear.steps: explicit steps have no error estimate that chooses their length: give "
                "jump or fraction"
            )
        if self.fraction is not None and (self.steps != "explicit" or self.jump != JumpSize()):
            raise InputError(
                "fraction is the length of explicit steps: give it with steps explicit and "
                "without jump, or leave it out"
            )

    @property
    def automatic(self) -> bool:
        """True if an error estimate chooses the length of steps."""
        return self.jump == JumpSize() and self.fraction is None

    def error_control(self) -> ErrorControl | None:
        """Return the control that chooses the length of steps, or None if the length is given."""
        if not self.automatic:
            return None
        relative = self.tolerance if self.depth_tolerance is None else None
        return ErrorControl(relative, self.depth_tolerance)

    def stepper(self) -> WearStepper:
        """Return the stepper that advances the surfaces of a half-space contact."""
        if self.steps == "explicit":
            return ExplicitStepper(self.fraction)
        control = self.error_control()
        return ImplicitStepper(control) if self.steps == "implicit" else SecondOrderStepper(control)

    def coupled(self, friction: Literal["constant", "evolving"] = "constant") -> CoupledSettings:
        """Return the settings of the coupled loop."""
        jump = self.jump if self.fraction is None else JumpSize(cycles=self.cycles / RECORDS)
        return CoupledSettings(
            self.cycles, jump, self.stop, self.resultants, self.drift, friction=friction
        )


def check_two_bodies(bodies: object) -> None:
    """Raise InputError unless ``bodies`` are two materials without layers."""
    if not _are_two(bodies, lambda body: isinstance(body, Material)):
        raise InputError(
            f"bodies are {checks.shown(bodies)}: give two, the Material of body 1 and that of "
            "body 2"
        )
    given: Any = bodies
    if any(body.layers for body in given):
        raise InputError("bodies have layers, which do not wear: leave them out")


def check_two_laws(laws: object) -> None:
    """Raise InputError unless ``laws`` are two wear laws."""
    if not _are_two(laws, lambda law: hasattr(law, "depth_per_pressure")):
        raise InputError(
            f"laws are {checks.shown(laws)}: give two, the wear law of body 1 and that of body 2"
        )


def _are_two(values: object, fits: Callable[[object], bool]) -> bool:
    """Return whether ``values`` are two, one for each body, and both fit."""
    return isinstance(values, tuple | list) and len(values) == 2 and all(map(fits, values))


# --- one face -------------------------------------------------------------------------------------


FaceState = InterfaceState | NodalFaceState
"""State of one contact face, whose surfaces are given by cell or by node."""


class FaceSolution(Protocol):
    """Protocol of what solves the cycles of one face on worn surfaces, given by cell or by node."""

    @property
    def areas(self) -> Array | float:
        """Area of each cell, or of each node ``(n,)``, of the worn surfaces [mm²]."""
        ...

    def on_cells(self, field: Array) -> Array:
        """Return a field of the worn surfaces on the cells of the grid ``(nx, ny)``."""
        ...

    def at_nodes(self, field: Array) -> Array:
        """Return a field of the worn surfaces at the nodes of the face ``(n,)``."""
        ...

    def fields(self, state: Any, increment: int) -> ContactFields:
        """Return tractions and slip of an increment on the present surfaces."""
        ...

    def tractions(self, state: Any) -> CycleTractions:
        """Return the tractions of a cycle on the present surfaces."""
        ...

    def unworn_tractions(self, history: FaceLoads, first: FirstContact) -> CycleTractions:
        """Return the tractions of the first cycle, which is solved already."""
        ...


class FaceContact:
    """One contact face on its grid.

    Parameters
    ----------
    face : ContactFace
        The face and the gap over it.
    contact : Contact
        Materials, laws and settings of the contact.
    wear : Wear
        Wear settings.
    solution : callable
        Returns what solves the cycles of the face, from its settings: a class such as
        :class:`wear.contact.interface.InterfaceContact`. It is the attribute ``contact``.
    stepper : Stepper, optional
        Stepper to use instead of that of ``wear``.
    """

    def __init__(
        self,
        face: ContactFace,
        contact: Contact,
        wear: Wear,
        solution: Callable[[InterfaceSettings], FaceSolution],
        stepper: WearStepper | None = None,
    ) -> None:
        self._contact_face, self.face, self.name = face, face.face, face.face.name
        self.grid, self.coarse_grid = face.grid(contact.grid), face.grid(face.coarse)
        self.transfer = FaceTransfer.between(face.face, self.grid)
        self.pair = ElasticPair(*contact.bodies)
        self.settings = InterfaceSettings(
            name=self.name,
            grid=self.grid,
            gap=gap_on(face, self.grid),
            transfer=self.transfer,
            pair=self.pair,
            laws=contact.laws,
            friction=contact.coulomb.at,
            stepper=stepper or wear.stepper(),
            method="full" if contact.method == "full" else "normal",
            gross_slip=contact.gross_slip,
            drive=face.drive,
            follow=_follow(contact, wear),
            link=contact.link,
            tolerance=contact.tolerance,
        )
        # Typed as any: some callers need more than the protocol, what only half-spaces have.
        self.contact: Any = solution(self.settings)

    def coarse_pressure(self, loads: LoadHistory, link: StructureLink, peak: int) -> Array:
        """Return the unworn peak pressure [MPa] on a grid as coarse as the structure's mesh."""
        contact = NormalContact(HalfSpace(self.coarse_grid, self.pair))
        grid = self.coarse_grid
        gap = gap_on(self._contact_face, grid) + link.lift(peak, grid.centres)
        load = self.settings.drive.pressing(loads, peak)
        return contact.solve(gap, **load, start=None, compliance=None).pressure

    @property
    def border_warning(self) -> Notice:
        """Warning for a contact that is cut off by the border of its grid."""
        return Notice(
            WarningKind.CONTACT_AT_BORDER,
            f"{self.name}: the contact touches the border of its grid, where it is cut off: "
            f"{self._contact_face.remedy}",
        )

    def transfer_of(self, body: Literal[1, 2]) -> FaceTransfer:
        """Return the transfer between the face of one body and the grid."""
        face = self.face.face(body)
        return self.transfer if face is self.face else FaceTransfer.between(face, self.grid)

    def on_grid(self, state: FaceState) -> Surfaces:
        """Return the surfaces of a state on the cells of the grid."""
        worn = state.surfaces
        fields = (worn.depth_1, worn.depth_2, worn.work_1, worn.work_2)
        return Surfaces(self.settings.gap, *map(self.contact.on_cells, fields))

    def depths_of_bodies(self, state: FaceState) -> tuple[Array, Array]:
        """Return the worn depths of both bodies at their own nodes [mm]; volumes are preserved."""
        depth_1, depth_2 = map(self.contact.at_nodes, state.surfaces.depths)
        if (to_1 := self.transfer_of(1)) is not self.transfer:
            depth_1 = to_1.to_nodes(self.contact.on_cells(state.surfaces.depth_1))
        return depth_1, depth_2


WornFaces = Sequence[tuple[FaceContact, FaceState]]
"""All contact faces, each with its state."""


def few_cells_warnings(
    stages: Sequence[FaceContact], pressures: Sequence[Array], worn: bool = False
) -> Iterator[Notice]:
    """Yield the warnings for contacts that cover too few cells at peak load.

    ``pressures`` ``(nx, ny)`` [MPa] are those of each contact, unworn or ``worn``. Raises
    TooCoarse for an unworn contact that is a single point on its grid.
    """
    after = " after wear" if worn else ""
    for stage, pressure in zip(stages, pressures, strict=True):
        if not (across := too_few_across(pressure > 0.0, stage.grid.line)):
            continue
        if is_point(pressure > 0.0) and not worn:
            raise TooCoarse(
                f"{stage.name}: the contact is only {' x '.join(map(str, across))} cells across, "
                "so that its size and pressure are meaningless: give it a finer grid"
            )
        yield Notice(
            WarningKind.FEW_CELLS,
            f"{stage.name}: the contact is only {' x '.join(map(str, across))} cells across"
            f"{after}, and {fewest_across(stage.grid.line)} are needed: the largest pressure may "
            f"have an error of {100.0 * peak_error(min(across)):.1f} %: give it a finer grid",
        )


def border_warnings(
    stages: Sequence[FaceContact], first: Sequence[FirstContact]
) -> Iterator[Notice]:
    """Yield the warnings for contacts that touch the border of their grid in the first cycle."""
    for stage, found in zip(stages, first, strict=True):
        if found.touches_border:
            yield stage.border_warning


@dataclass(frozen=True)
class ContactEnd:
    """A cycle on the surfaces at the end of a run.

    ``pressure_of_coarse_run`` ``(t, nx, ny)`` [MPa] is the pressure on the surfaces of the run with
    steps of twice the length; None if no such steps were taken.
    """

    tractions: CycleTractions
    pressure_of_coarse_run: Array | None


def last_cycle(contact: FaceSolution, state: FaceState) -> ContactEnd:
    """Return the cycle of a contact on the surfaces at the end of a run."""
    pressure = None
    if step_errors(state, contact.areas) is not None:
        pressure = contact.tractions(state.coarse).pressure
    return ContactEnd(contact.tractions(state), pressure)


def gap_on(face: ContactFace, grid: Grid) -> Array:
    """Return the unworn gap of a face on a grid over it ``(nx, ny)`` [mm]."""
    gap = face.gap(grid.x, grid.y)
    # Values in a row would be spread along y, whatever they belong to.
    if np.ndim(gap) != 1:
        with suppress(ValueError):
            return np.ascontiguousarray(np.broadcast_to(gap, grid.shape))
    raise InputError(
        f"{face.face.name}: the gap has shape {np.shape(gap)} at x {grid.x.shape} and y "
        f"{grid.y.shape}: give {grid.shape}"
    )


def _follow(contact: Contact, wear: Wear) -> bool | None:
    """Return whether to follow surfaces that move over each other; None to decide by the motion."""
    follow = {"auto": None, "follow": True, "neglect": False}[wear.motion]
    if follow is None and getattr(contact.laws[0], "coefficient", None) == 0.0:
        return False  # a surface that does not wear looks the same everywhere
    return follow


ContactOf = Callable[[str], Contact]
"""Return the contact of an interface by its name."""
