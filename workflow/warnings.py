"""Things a user should know about a run that went well all the same."""

from __future__ import annotations

from sa_solver.reference.flat_rounded import FlatRoundedPunch
from workflow.case import DovetailCase, WearCase
from workflow.checkpoint import RunState
from workflow.contact_stage import ContactStage, FirstContact
from workflow.reporter import Reporter
from workflow.structure_stage import StructureStage

# Every cycle should repeat the forces of the one before; a larger change is a cycle not closed.
OPEN_CYCLE = 0.02
# Forces and moments on body 2 left out of balance, relative: the friction solver leaves 1e-7.
OUT_OF_BALANCE = 1e-3
# Energies of structure and half-space over a cycle that differ by more tell of different slips.
ENERGIES_APART = 0.25
# Share of the closed form's edge peak that the grid may miss.
PEAK_ERROR = 0.05


def warn_of_structure(stage: StructureStage, reporter: Reporter) -> None:
    """What the model knows, cycles that do not close, faces that lose their contact."""
    stage.model.warn(stage.structure, reporter)
    unworn = stage.unworn_cycle
    if unworn.closure > OPEN_CYCLE:
        reporter.warn(
            f"the last two of {unworn.cycles} cycles differ by {unworn.closure:.1%} of the largest "
            "contact force: the cycle that feeds the wear is not closed"
        )
    imbalance = float(unworn.equilibrium.max())
    if imbalance > OUT_OF_BALANCE:
        reporter.warn(
            f"forces and moments on body 2 are out of balance by {imbalance:.1e}: the stiffness of "
            "peak load does not suit the other increments (nonlinearity.stiffness)"
        )
    for history in unworn.histories:
        name, P = history.interface.name, history.loads.P
        if P.max() <= 0.0:
            reporter.warn(f"{name} is open all the time: it does not wear")
        elif P[stage.peak] <= 0.0:
            reporter.warn(f"{name} is open at peak load: its pressure and stress there are none")


def warn_of_contact(
    case: WearCase,
    peak: int,
    stages: list[ContactStage],
    state: RunState,
    first: list[FirstContact],
    reporter: Reporter,
) -> None:
    """Unlike bodies, pressures above yield, contacts at the border, edge peaks cut by the grid."""
    pair = stages[0].pair
    if case.contact.method == "normal" and not pair.similar:
        reporter.warn(
            f"the materials differ (Dundurs' beta {pair.dundurs_beta:.2g}): shear then moves the "
            "surfaces normally, which contact.method: normal leaves out; use full"
        )
    yield_stress = min(case.material(number).yield_stress for number in (1, 2))
    for stage, own, result in zip(stages, state.interfaces, first, strict=True):
        highest = result.highest_pressure
        if highest > yield_stress:
            reporter.warn(
                f"{stage.name}: the pressure reaches {highest:.0f} MPa, above the yield stress of "
                f"{yield_stress:.0f} MPa: the elastic solution is no longer valid there"
            )
        given, found = own.loads.mean_energy, float(result.energy.sum())
        if abs(found - given) > ENERGIES_APART * max(found, given) and not result.cycle:
            reporter.warn(
                f"{stage.name}: pressure on the grid and slip of the structure dissipate "
                f"{found:.3g} N mm a cycle, the structure {given:.3g}: its mesh is too coarse for "
                "the slip zone, or little slips; refine it or use contact.method: full"
            )
        if result.touches_border:
            warn_of_border(stage, reporter)
        if not isinstance(case, DovetailCase):
            continue
        load = float(own.loads.P[peak])
        for edge, error in edge_peak_errors(case, stage, load).items():
            if abs(error) > PEAK_ERROR:
                reporter.warn(
                    f"{stage.name}: the grid misses {abs(error):.0%} of the pressure peak at the "
                    f"{edge}: refine contact.grid or increase structure.{edge}_radius"
                )


def warn_of_growth(stages: list[ContactStage], state: RunState, reporter: Reporter) -> None:
    """Contacts that have grown to the border of their grid: they have worn there."""
    for stage, own in zip(stages, state.interfaces, strict=True):
        worn = own.surfaces.depth
        if worn[[0, -1], :].any() or (not stage.grid.line and worn[:, [0, -1]].any()):
            warn_of_border(stage, reporter)


def warn_of_border(stage: ContactStage, reporter: Reporter) -> None:
    """A contact cut off by the end of its grid."""
    reporter.warn(
        f"{stage.name}: the contact touches the border of its grid, where it is cut off: "
        f"{stage.remedy}"
    )


def edge_peak_errors(case: DovetailCase, stage: ContactStage, load: float) -> dict[str, float]:
    """What the grid makes of the closed form's edge peaks, relative, under a centred ``load``.

    The plane strain profile across the flank stands for both: the peak at the slot ends is set by
    the same short side.
    """
    if load <= 0.0:
        return {}
    dovetail = case.structure
    half_width = 0.5 * dovetail.flank_length
    per_length, radii = load, {"edge": dovetail.edge_radius}
    if not stage.grid.line:
        per_length = load / (dovetail.slot_length - 2.0 * dovetail.end_width)
        radii["end"] = dovetail.end_radius
    modulus = stage.pair.contact_modulus
    return {
        edge: FlatRoundedPunch(half_width, radius, per_length, modulus).peak_error(pitch)
        for (edge, radius), pitch in zip(radii.items(), stage.grid.pitch, strict=False)
    }
