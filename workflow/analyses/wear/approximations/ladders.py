"""Settings of the approximations of a case, each from coarse to fine.

A rung that the case's schema refuses is left out by the chart, so that ladders may go beyond what a
case admits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Literal

from workflow.analyses.contact.case import HEIGHTS
from workflow.analyses.wear.approximations.approximation import Rung, Settings, entry_at
from workflow.analyses.wear.case.base import WearCase
from workflow.case.sections import Case

# Refinements of a contact grid along each direction. A grid twice as fine takes four times as long
# in 3-D, once for every increment of every jump where the contact wears.
CONTACT_GRIDS = 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0, 4.0
WEAR_GRIDS = 1 / 4, 1 / 2, 1.0, 2.0
FEWEST_CELLS = 16  # along a direction; with fewer, the contact is hardly resolved
TOLERANCES = 1e-3, 1e-4, 1e-5, 1e-6
# Ratio of the tolerance of the finest rung to that of the case.
FINER_TOLERANCE = 1e-2
INCREMENTS = 1 / 4, 1 / 2, 1.0, 2.0
INCREMENTS_2D = 1 / 4, 1 / 2, 1.0, 2.0, 4.0, 8.0
DRIFTS = 0.2, 0.1, 0.05, 0.02, 0.01
# The time to condense the structure grows as about the fourth power of the refinement in 3-D.
MESHES_3D = 0.5, 0.5**0.5, 1.0, 2.0**0.5
MESHES_2D = 0.5, 0.5**0.5, 1.0, 2.0**0.5, 2.0, 2.0**1.5, 4.0
# Refinements of a mesh whose nodes carry the contact without a half-space.
MESHES_ALONE = 1.0, 2.0, 4.0, 8.0
# Links of half-spaces to the structure, and refinements of its mesh for them in plane problems.
LINKS = {"half_space": "half-space", "corrected": "corrected"}
MESHES_LINKED = 0.5, 1.0, 2.0, 4.0
JUMPS = 5, 10, 20, 40, 80, 160
ERRORS = 0.1, 0.03, 0.01, 3e-3, 1e-3
EXPLICIT = 0.9, 0.45
# Number of rungs of jumps and errors left out in 3-D, where a cycle takes seconds.
COARSER_3D = 2


def is_line(case: Case) -> bool:
    """Return whether the contacts are line contacts."""
    size = entry_at(case, "contact.size")
    return entry_at(case, "structure.dimension") == 2 or isinstance(size, float)


# --- contact ------------------------------------------------------------------------------------


def grids(case: Case) -> Iterator[Rung]:
    """Yield coarser and finer contact grids."""
    if entry_at(case, "structure.shape") == HEIGHTS:
        return
    cells = entry_at(case, "contact.grid")
    line = is_line(case)
    cheap = line or case.analysis == "contact"
    for factor in CONTACT_GRIDS if cheap else WEAR_GRIDS:
        # Even numbers keep the middle between two cells on every rung; a line has no other cells.
        finer = [2 * round(0.5 * factor * count) for count in cells[: 1 if line else 2]]
        if min(finer) < FEWEST_CELLS:
            continue
        name = f"{finer[0]} cells" if line else " x ".join(map(str, finer))
        yield Rung(name, {"contact.grid": [*finer, *cells[len(finer) :]]}, 1.0 / finer[0])


def tolerances(case: Case) -> Iterator[Rung]:
    """Yield looser tolerances of the contact solver, that of the case, and a tighter one."""
    given = entry_at(case, "contact.tolerance")
    baseline = case.contact_tolerance if isinstance(case, WearCase) else given
    looser = [tolerance for tolerance in TOLERANCES if tolerance > baseline]
    for tolerance in (*looser, baseline, max(FINER_TOLERANCE * baseline, 1e-12)):
        yield Rung(f"{tolerance:.0e}", {"contact.tolerance": tolerance}, tolerance)


def methods(case: Case) -> Iterator[Rung]:
    """Yield the slips of the structure, then those of the half-space."""
    for method in ("normal", "full"):
        yield Rung(method, {"contact.method": method})


def histories(case: Case) -> Iterator[Rung]:
    """Yield reversals alone, then the full history with fewer and with more increments."""
    yield Rung("reversals", {"contact.history": "reversals"}, branch="reversals")
    legs, full = entry_at(case, "load_path.legs"), {"contact.history": "full"}
    if not legs or all(leg.increments == 1 for leg in legs):
        yield Rung("full", full, branch="full")
        return
    for factor in INCREMENTS:
        # A leg of one increment is a single load, which finer increments would not follow better.
        counts = [leg.increments for leg in legs]
        counts = [n if n == 1 else max(1, round(factor * n)) for n in counts]
        divided = {f"load_path.legs.{k}.increments": n for k, n in enumerate(counts)}
        name = f"full, {sum(counts)} increments"
        yield Rung(name, {**full, **divided}, 1.0 / factor, branch="full")


def increments(case: Case) -> Iterator[Rung]:
    """Yield fewer and more increments for the loads of a wear cycle."""
    for factor in INCREMENTS_2D if is_line(case) else INCREMENTS:
        yield _in_increments(case, factor)


def _in_increments(case: Case, factor: float) -> Rung:
    """Return the rung with ``factor`` times the increments of a cycle, or of each of its legs."""
    written: int | Sequence[int] = entry_at(case, "load_path.increments")
    legs = (written,) if isinstance(written, int) else written
    counts = [max(1, round(factor * count)) for count in legs]
    value = counts[0] if isinstance(written, int) else counts
    return Rung(f"{sum(counts)} increments", {"load_path.increments": value}, 1.0 / factor)


# --- wear ---------------------------------------------------------------------------------------


def steppers(case: Case) -> Iterator[Rung]:
    """Yield explicit steps in shares of their limit, then automatic and fixed jumps."""
    cycles = entry_at(case, "wear.cycles")
    line = is_line(case)
    coarser = 0 if line else COARSER_3D
    for share in EXPLICIT if line else EXPLICIT[:1]:
        step = {"kind": "explicit", "fraction": share}
        name = f"explicit, {share:g} of its limit"
        yield Rung(name, {"wear.step": step}, share, branch="explicit", of_limit=share)
    for kind, word in (("implicit", "implicit"), ("second_order", "second order")):
        branch = f"{word}, automatic"
        for tolerance in ERRORS[: len(ERRORS) - coarser]:
            settings = {
                "wear.step": {"kind": kind},
                "wear.tolerance": tolerance,
                "wear.depth_tolerance": None,
            }
            yield Rung(f"{branch}, {100 * tolerance:g} %", settings, tolerance, branch=branch)
        for count in JUMPS[: len(JUMPS) - coarser]:
            step = {"kind": kind, "cycles": cycles / count}
            yield Rung(f"{word}, {count} jumps", {"wear.step": step}, 1.0 / count, branch=word)


def couplings(case: Case) -> Iterator[Rung]:
    """Yield unworn loads, loads that follow at ever smaller drifts, and after every jump."""
    written = entry_at(case, "coupling.drift")
    rungs = {
        "constant": ("constant", written),
        **{f"drift of {100 * drift:g} %": ("drift", drift) for drift in DRIFTS},
        "every jump": ("every", written),
    }
    for name, (resultants, drift) in rungs.items():
        yield Rung(name, {"coupling": {"resultants": resultants, "drift": drift}})


# --- structure ----------------------------------------------------------------------------------


def dimensions(case: Case) -> Iterator[Rung]:
    """Yield the plane section of a dovetail, then the joint in space."""
    if entry_at(case, "structure.kind") == "dovetail":
        for dimension in (2, 3):
            yield Rung(f"{dimension}-D", {"structure.dimension": dimension})


def meshes(case: Case) -> Iterator[Rung]:
    """Yield coarser and finer meshes of the structure."""
    yield from _refined(case, MESHES_2D if is_line(case) else MESHES_3D)


def _refined(case: Case, factors: Sequence[float]) -> Iterator[Rung]:
    """Yield rungs of a mesh that is finer by each factor, where the case gives its fineness."""
    for factor in factors:
        if entry_at(case, "mesh.flank_nodes") is not None:
            settings = flank_mesh(case, factor)
            across, along = settings["mesh.flank_nodes"]
            name = f"{across} x {along} nodes"
        elif (written := entry_at(case, "mesh.pad_elements")) is not None:
            elements = 2 * max(1, round(0.5 * factor * written))
            settings = {"mesh.pad_elements": elements, **_elements(case, factor)}
            name = f"{elements} elements on the pad"
        elif entry_at(case, "structure.kind") == "mesh" and entry_at(case, "mesh.size"):
            settings = _elements(case, factor)  # of a CAD file
            name = f"elements of {settings['mesh.size']:.3g} mm"
        else:
            return
        yield Rung(name, settings, 1.0 / factor)


def flank_mesh(case: Any, factor: float) -> dict[str, Any]:
    """Return the mesh of a dovetail with elements that are finer by ``factor``."""
    refined = case.mesh.described().refined(factor)
    return {"mesh.flank_nodes": refined.flank_nodes, "mesh.size": refined.size}


def slots(case: Case) -> Iterator[Rung]:
    """Yield fewer and more nodes along the slot of a dovetail in space."""
    if entry_at(case, "mesh.flank_nodes") is None or is_line(case):
        return
    for factor in MESHES_3D:
        settings = slot_mesh(case, factor)
        _, along = settings["mesh.flank_nodes"]
        yield Rung(f"{along} nodes along the slot", settings, 1.0 / factor)


def slot_mesh(case: Any, factor: float) -> dict[str, Any]:
    """Return the mesh of a dovetail with layers along the slot that are finer by ``factor``."""
    across, _ = case.mesh.flank_nodes
    _, along = case.mesh.described().refined(factor).flank_nodes
    return {"mesh.flank_nodes": (across, along)}


def _elements(case: Any, factor: float) -> dict[str, Any]:
    return {"mesh.size": case.mesh.size / factor}


def orders(case: Case) -> Iterator[Rung]:
    """Yield finite elements of first and of second order."""
    orders: tuple[Literal[1, 2], ...] = (1, 2)
    for order in orders:
        yield Rung(f"order {order}", _of_order(case, order))


def _of_order(case: Any, order: Literal[1, 2]) -> dict[str, Any]:
    """Return settings of elements of an order; the nodes of a dovetail's flank depend on it."""
    settings: dict[str, Any] = {"mesh.order": order}
    if entry_at(case, "mesh.flank_nodes") is not None:
        settings["mesh.flank_nodes"] = case.mesh.described().of_order(order).flank_nodes
    return settings


def links(case: Case) -> Iterator[Rung]:
    """Yield half-spaces linked to the structure by forces, or corrected by its nodes."""
    # Specimens wear by finite elements; their half-space is for comparison and has no method.
    if entry_at(case, "contact.method") not in ("normal", "full"):
        return
    for link, word in LINKS.items():
        for mesh in _refined_or_own(case, MESHES_LINKED if is_line(case) else MESHES_3D):
            settings: Settings = {"contact.link": link, **mesh.settings}
            yield Rung(f"{word}, {mesh.name}", settings, mesh.step, branch=word)


def references(case: Case) -> Iterator[Rung]:
    """Yield the half-space's methods, then meshes of finite elements alone, finer and finer.

    The latter use elements and wear steps of second order, and twice the increments.
    """
    kind = entry_at(case, "structure.kind")
    plane = kind == "dovetail" and is_line(case)
    if kind == "mesh":
        mesh = entry_at(case, "structure").mesh(entry_at(case, "mesh.size"))
        plane = mesh.interfaces[0].line
    if not plane:
        return
    yield from methods(case)
    settings: dict[str, Any] = {
        "contact.method": "nodes",
        "wear.step": {"kind": "second_order"},
    }
    if entry_at(case, "mesh.order") is not None:
        settings |= _of_order(case, 2)
    if entry_at(case, "load_path.increments") is not None:
        settings |= _in_increments(case, 2.0).settings
    for rung in _refined_or_own(case, MESHES_ALONE):
        alone = {**settings, **rung.settings}
        yield Rung(f"{rung.name} alone", alone, rung.step, branch="alone")


def _refined_or_own(case: Case, factors: Sequence[float]) -> list[Rung]:
    """Return refined meshes, or that of the case where it does not give its fineness."""
    return list(_refined(case, factors)) or [Rung("its mesh")]
