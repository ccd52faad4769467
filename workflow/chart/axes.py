"""Approximations that can be charted, each with a ladder of settings from coarse to fine.

A rung of a ladder is a few ``--set`` overrides of the case; all other settings stay as written. A
rung that the case's schema refuses is left out, and an axis with fewer than two rungs does not
apply to the case.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workflow.analyses.contact.case import HEIGHTS
from workflow.case.sections import Case
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError, UserError
from workflow.kinds import load_case

# Refinements of a contact grid along each direction. A grid twice as fine takes four times as long
# in 3-D, once for every increment of every jump where the contact wears.
CONTACT_GRIDS = 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0, 4.0
WEAR_GRIDS = 1 / 4, 1 / 2, 1.0, 2.0
FEWEST_CELLS = 16  # with fewer, the contact is hardly resolved
TOLERANCES = 1e-3, 1e-4, 1e-5, 1e-6
# Ratio of the tolerance of the finest rung to that of the case.
FINER_TOLERANCE = 1e-2
INCREMENTS = 1 / 4, 1 / 2, 1.0, 2.0
INCREMENTS_2D = 1 / 4, 1 / 2, 1.0, 2.0, 4.0, 8.0
DRIFTS = 0.2, 0.1, 0.05, 0.02, 0.01
# The time to condense the structure grows as about the fourth power of the refinement in 3-D.
MESHES_3D = 0.5, 0.5**0.5, 1.0, 2.0**0.5
MESHES_2D = 0.5, 0.5**0.5, 1.0, 2.0**0.5, 2.0, 2.0**1.5, 4.0
# Refinements of a mesh whose nodes carry the contact without a half-space, and the path of its
# order.
MESHES_ALONE = 1.0, 2.0, 4.0, 8.0
ORDER = "mesh.order"
# Links of half-spaces to the structure, and refinements of its mesh for them in plane problems.
LINKS = {"half_space": "half-space", "corrected": "corrected"}
MESHES_LINKED = 0.5, 1.0, 2.0, 4.0
JUMPS = 5, 10, 20, 40, 80, 160
ERRORS = 0.1, 0.03, 0.01, 3e-3, 1e-3
EXPLICIT = 0.9, 0.45
# Multiples of the time step.
TIME_STEPS = 4.0, 2.0, 1.0, 0.5, 0.25
# Number of rungs of jumps and errors left out in 3-D, where a cycle takes seconds.
COARSER_3D = 2
# Numbers of odd harmonics of a forced response, and samples of a period for each of them.
ODD_HARMONICS, SAMPLES_PER_HARMONIC = (1, 2, 3, 5, 8, 15, 30), 32
SAMPLES = (32, 64, 128, 256, 512, 1024, 2048)


@dataclass(frozen=True)
class Rung:
    """One setting: ``name`` identifies it on its axis, ``branch`` is the line that it belongs to.

    ``step`` goes to zero with the error, in any unit; None where nothing converges. ``of_limit`` is
    the ratio of an explicit step to its stability limit.
    """

    name: str
    overrides: tuple[str, ...]
    step: float | None = None
    branch: str = ""
    of_limit: float | None = None


AS_WRITTEN = Rung("as written", ())


@dataclass(frozen=True)
class Axis:
    """Named approximation with its ladder of settings.

    ``ladder`` yields the rungs of a case, coarse to fine; the last is the reference for all.
    ``order`` is the highest order of convergence that the estimate assumes, None for a choice
    whose last rung is right by definition. ``closed_form`` says that the ladder ends at an exact
    solution where there is one. On an axis that ``moves_states`` the rungs compute different
    increments; one across ``sections`` compares the middle of the faces per length.
    """

    name: str
    what: str
    ladder: Callable[[Case], Iterator[Rung]]
    order: float | None = None
    closed_form: bool = False
    moves_states: bool = False
    sections: bool = False


@dataclass(frozen=True)
class Setting:
    """Rung applied to its case; ``text`` is the case as YAML, which identifies equal settings."""

    rung: Rung
    case: Case
    text: str

    @classmethod
    def of(cls, case: Path, base: Sequence[str], rung: Rung = AS_WRITTEN) -> Setting:
        """Return the setting of a rung on a case file with overrides ``base``; raise CaseError."""
        changed = load_case(case, (*base, *rung.overrides))
        return cls(rung, changed, dump_case(changed))


def axes_of(case: Path, base: Sequence[str], names: Sequence[str]) -> dict[Axis, list[Setting]]:
    """Return the rungs of the axes called ``names``; without names, of all axes that apply.

    Raises :class:`UserError` for an axis that does not exist or does not apply.
    """
    baseline = Setting.of(case, base)
    wanted = [axis for axis in AXES if not names or axis.name in names]
    applying = _applying(wanted, baseline, case, base)
    for name in names:
        if all(axis.name != name for axis in applying):
            known = any(axis.name == name for axis in AXES)
            wrong = "does not apply to this case" if known else "no such axis"
            offered = ", ".join(axis.name for axis in _applying(AXES, baseline, case, base))
            raise UserError(f"--axis {name}: {wrong}; allowed: {offered or 'none'}")
    if not applying:
        raise UserError(f"{case}: a case of this kind has nothing to chart")
    return applying


def _applying(
    axes: Sequence[Axis], baseline: Setting, case: Path, base: Sequence[str]
) -> dict[Axis, list[Setting]]:
    ladders = {axis: _settings(axis, baseline, case, base) for axis in axes}
    return {axis: settings for axis, settings in ladders.items() if len(settings) > 1}


def _settings(axis: Axis, baseline: Setting, case: Path, base: Sequence[str]) -> list[Setting]:
    """Return the rungs of the axis that the case admits, with its own settings, each once."""
    settings: dict[str, Setting] = {}
    for rung in axis.ladder(baseline.case):
        try:
            setting = Setting.of(case, base, rung)
        except CaseError:
            continue
        settings.setdefault(setting.text, setting)
    if settings and baseline.text not in settings:
        return [baseline, *settings.values()]
    return list(settings.values())


def entry_at(case: Case, path: str) -> Any:
    """Return the entry at a dotted path, None where this kind of case has none."""
    node: Any = case
    for key in path.split("."):
        node = getattr(node, key, None)
    return node


def _is_line(case: Case) -> bool:
    """Return whether the contacts are line contacts."""
    size = entry_at(case, "contact.size")
    return entry_at(case, "structure.dimension") == 2 or isinstance(size, float)


# --- contact ------------------------------------------------------------------------------------


def _grids(case: Case) -> Iterator[Rung]:
    grid = entry_at(case, "contact.grid")
    if grid is None or entry_at(case, "structure.shape") == HEIGHTS:
        return
    cells = tuple(grid)
    line = _is_line(case)
    cheap = line or case.analysis == "contact"
    for factor in CONTACT_GRIDS if cheap else WEAR_GRIDS:
        # Even numbers keep the middle between two cells on every rung; a line has no other cells.
        finer = [2 * round(0.5 * factor * count) for count in cells[: 1 if line else 2]]
        if min(finer) < FEWEST_CELLS:
            continue
        shown = f"{finer[0]} strips" if line else " x ".join(map(str, finer))
        yield Rung(shown, (f"contact.grid={[*finer, *cells[len(finer) :]]}",), 1.0 / finer[0])


def _tolerances(case: Case) -> Iterator[Rung]:
    baseline = entry_at(case, "contact.tolerance")
    if baseline is None:
        return
    coarser = [tolerance for tolerance in TOLERANCES if tolerance > baseline]
    for tolerance in (*coarser, baseline, max(FINER_TOLERANCE * baseline, 1e-12)):
        yield Rung(f"{tolerance:.0e}", (f"contact.tolerance={tolerance!r}",), tolerance)


def _methods(case: Case) -> Iterator[Rung]:
    if entry_at(case, "contact.method") is not None:
        for method in ("normal", "full"):
            yield Rung(method, (f"contact.method={method}",))


def _histories(case: Case) -> Iterator[Rung]:
    if entry_at(case, "contact.history") is not None:
        yield Rung("reversals", ("contact.history=reversals",), branch="reversals")
        yield from _legs(case)


def _increments(case: Case) -> Iterator[Rung]:
    """Yield rungs with fewer and with more increments for the loads of a wear cycle."""
    increments = entry_at(case, "load_path.increments")
    if increments is None:
        return
    for factor in INCREMENTS_2D if _is_line(case) else INCREMENTS:
        yield _in_increments(increments, factor)


def _in_increments(increments: int | Sequence[int], factor: float) -> Rung:
    """Return the rung with ``factor`` times the increments of a cycle, or of each of its legs."""
    legs = (increments,) if isinstance(increments, int) else increments
    counts = [max(1, round(factor * count)) for count in legs]
    value = counts[0] if isinstance(increments, int) else counts
    return Rung(f"{sum(counts)} increments", (f"load_path.increments={value}",), 1.0 / factor)


def _legs(case: Case) -> Iterator[Rung]:
    """Yield rungs of the full history of a contact case with fewer and with more increments."""
    legs = entry_at(case, "load_path.legs")
    full = "contact.history=full"
    if not legs or all(leg.increments == 1 for leg in legs):
        yield Rung("full", (full,), branch="full")
        return
    for factor in INCREMENTS:
        # A leg of one increment is a single load, which finer increments would not follow better.
        counts = [leg.increments for leg in legs]
        counts = [n if n == 1 else max(1, round(factor * n)) for n in counts]
        overrides = [f"load_path.legs.{k}.increments={n}" for k, n in enumerate(counts)]
        name = f"full, {sum(counts)} increments"
        yield Rung(name, (full, *overrides), 1.0 / factor, branch="full")


# --- wear ---------------------------------------------------------------------------------------


def _steppers(case: Case) -> Iterator[Rung]:
    """Yield rungs of explicit steps in shares of their limit, then automatic and fixed jumps."""
    cycles = entry_at(case, "wear.cycles")
    if entry_at(case, "wear.step.kind") is None:
        return
    coarser = 0 if _is_line(case) else COARSER_3D
    for share in EXPLICIT if _is_line(case) else EXPLICIT[:1]:
        step = f"wear.step={{kind: explicit, fraction: {share}}}"
        name = f"explicit, {share:g} of its limit"
        yield Rung(name, (step,), share, branch="explicit", of_limit=share)
    for kind, word in (("implicit", "implicit"), ("second_order", "second order")):
        for tolerance in ERRORS[: len(ERRORS) - coarser]:
            overrides = (
                *(f"wear.step={{kind: {kind}}}", f"wear.tolerance={tolerance!r}"),
                "wear.depth_tolerance=null",
            )
            branch = f"{word}, automatic"
            yield Rung(f"{branch}, {100 * tolerance:g} %", overrides, tolerance, branch=branch)
        for count in JUMPS[: len(JUMPS) - coarser]:
            step = f"wear.step={{kind: {kind}, cycles: {cycles / count!r}}}"
            yield Rung(f"{word}, {count} jumps", (step,), 1.0 / count, branch=word)


def _couplings(case: Case) -> Iterator[Rung]:
    coupling = entry_at(case, "coupling")
    if coupling is None:
        return
    yield Rung("constant", (f"coupling={{resultants: constant, drift: {coupling.drift!r}}}",))
    for drift in DRIFTS:
        text = f"coupling={{resultants: drift, drift: {drift!r}}}"
        yield Rung(f"drift of {100 * drift:g} %", (text,))
    yield Rung("every jump", (f"coupling={{resultants: every, drift: {coupling.drift!r}}}",))


# --- time ---------------------------------------------------------------------------------------


def _time_steps(case: Case) -> Iterator[Rung]:
    """Yield longer and shorter steps; the case refuses those that do not resolve the excitation."""
    base_step = entry_at(case, "integration.step")
    if base_step is None:
        return
    for factor in TIME_STEPS:
        step = factor * base_step
        yield Rung(f"{1e6 * step:.3g} us", (f"integration.step={step!r}",), factor)


# --- vibration ----------------------------------------------------------------------------------


def _harmonics(case: Case) -> Iterator[Rung]:
    """Yield fewer and more odd harmonics, with enough samples for the highest."""
    samples = entry_at(case, "resolution.samples")
    if samples is None:
        return
    for count in ODD_HARMONICS:
        fine = max(samples, SAMPLES_PER_HARMONIC * count)
        resolution = f"resolution={{harmonics: {count}, samples: {fine}}}"
        name = "1 harmonic" if count == 1 else f"{count} odd harmonics"
        yield Rung(name, (resolution,), 1.0 / count)


def _samples(case: Case) -> Iterator[Rung]:
    """Yield fewer and more samples of the case's harmonics; the case refuses too few."""
    harmonics = entry_at(case, "resolution.harmonics")
    if harmonics is None:
        return
    for samples in SAMPLES:
        resolution = f"resolution={{harmonics: {list(harmonics)}, samples: {samples}}}"
        yield Rung(f"{samples} samples", (resolution,), 1.0 / samples)


# --- structure ----------------------------------------------------------------------------------


def _dimensions(case: Case) -> Iterator[Rung]:
    if entry_at(case, "structure.kind") == "dovetail":
        for dimension in (2, 3):
            yield Rung(f"{dimension}-D", (f"structure.dimension={dimension}",))


def _meshes(case: Case) -> Iterator[Rung]:
    yield from _refined(case, MESHES_2D if _is_line(case) else MESHES_3D)


def _refined(case: Case, factors: Sequence[float]) -> Iterator[Rung]:
    """Yield rungs of a mesh that is finer by each factor, where the case gives its fineness."""
    for factor in factors:
        if (nodes := entry_at(case, "mesh.flank_nodes")) is not None:
            counts = [max(3, 1 + round(factor * (count - 1))) for count in nodes]
            size = entry_at(case, "mesh.size") / factor
            overrides = f"mesh.flank_nodes={counts}", f"mesh.size={size!r}"
            yield Rung(f"{counts[0]} x {counts[1]} nodes", overrides, 1.0 / factor)
        elif (across := entry_at(case, "mesh.pad_elements")) is not None:
            elements = 2 * max(1, round(0.5 * factor * across))
            size = entry_at(case, "mesh.size") / factor
            overrides = f"mesh.pad_elements={elements}", f"mesh.size={size!r}"
            yield Rung(f"{elements} elements on the pad", overrides, 1.0 / factor)
        elif entry_at(case, "structure.kind") == "mesh" and entry_at(case, "mesh.size"):
            size = entry_at(case, "mesh.size") / factor  # size of the elements of a CAD file
            yield Rung(f"elements of {size:.3g} mm", (f"mesh.size={size!r}",), 1.0 / factor)


def _orders(case: Case) -> Iterator[Rung]:
    if entry_at(case, ORDER) is not None:
        for order in (1, 2):
            yield Rung(f"order {order}", (f"{ORDER}={order}",))


def _links(case: Case) -> Iterator[Rung]:
    """Yield rungs of half-spaces linked to the structure by forces, or corrected by its nodes."""
    # Specimens wear by finite elements; their half-space is for comparison and has no method.
    if entry_at(case, "contact.method") not in ("normal", "full"):
        return
    factors = MESHES_LINKED if _is_line(case) else MESHES_3D
    meshes = list(_refined(case, factors)) or [Rung("its mesh", ())]
    for link, word in LINKS.items():
        for mesh in meshes:
            overrides = (f"contact.link={link}", *mesh.overrides)
            yield Rung(f"{word}, {mesh.name}", overrides, mesh.step, branch=word)


def _alone(case: Case) -> Iterator[Rung]:
    """Yield the half-space's methods, then meshes of finite elements alone, finer and finer.

    The latter use elements and wear steps of second order, and twice the increments.
    """
    kind = entry_at(case, "structure.kind")
    plane = False
    if kind == "mesh":
        mesh = entry_at(case, "structure").mesh(entry_at(case, "mesh.size"))
        plane = mesh.interfaces[0].line
    if not plane and not (kind == "dovetail" and _is_line(case)):
        return
    yield from _methods(case)
    further = ["contact.method=nodes", "wear.step={kind: second_order}"]
    further += [f"{ORDER}=2"] if entry_at(case, ORDER) is not None else []
    increments = entry_at(case, "load_path.increments")
    if increments is not None:
        further += _in_increments(increments, 2.0).overrides
    meshes = list(_refined(case, MESHES_ALONE)) or [Rung("its mesh", ())]
    for mesh in meshes:
        overrides = (*further, *mesh.overrides)
        yield Rung(f"{mesh.name} alone", overrides, mesh.step, branch="alone")


# Orders of convergence: the square-root end of a pressure keeps a grid from second order, friction
# along a path of increments is of first order, and so is a residual in its tolerance.
AXES = (
    Axis("grid", "cells of the contact grid", _grids, order=2.0, closed_form=True),
    Axis("tolerance", "tolerance of the contact solver", _tolerances, order=1.0),
    Axis("method", "slip of the structure or of the half-space", _methods),
    Axis("stepper", "how wear steps, and how far", _steppers, order=2.0),
    Axis("dimension", "two dimensions or three", _dimensions, sections=True),
    Axis("coupling", "how often worn surfaces go back to the structure", _couplings),
    Axis("history", "increments of the load path", _histories, order=1.0, moves_states=True),
    Axis("increments", "increments of a cycle", _increments, order=2.0),
    Axis("link", "half-spaces, or corrected by the structure's nodes", _links, order=2.0),
    Axis("mesh", "finite elements of the structure", _meshes, order=2.0),
    Axis("order", "order of the finite elements", _orders),
    Axis("reference", "half-space, or finite elements alone", _alone, order=1.0),
    Axis("step", "step of the motion in time", _time_steps, order=2.0),
    Axis("harmonics", "odd harmonics of the motion", _harmonics, order=2.0),
    Axis("samples", "samples of a period", _samples, order=2.0),
)
