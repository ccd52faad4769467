"""Warnings about results that may be wrong though all solvers converge, for models and cases.

Each function has one judgement. Models warn of them as :class:`workflow.errors.ModelWarning`, and
runs of cases in their log and report.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from sa_solver.types import Array, Material
from wear.contact.interface import FirstContact, InterfaceContact
from wear.contact.link import StructureLink
from wear.coupled_state import CoupledState
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.checks.limits import USUAL_FRICTION
from workflow.models.contact import FaceContact, WornFaces

LARGEST_CHANGE = 0.5
"""Largest relative change of friction within a cycle, or within a wear jump under loads that were
solved with friction at its beginning.
"""


def friction_warnings(stages: Sequence[FaceContact]) -> Iterator[Notice]:
    """Yield the warnings for contacts whose coefficient of friction is unusual."""
    low, high = USUAL_FRICTION
    for stage in stages:
        friction = stage.settings.friction(0.0)
        if friction > 0.0 and not low <= friction <= high:
            yield Notice(
                WarningKind.UNUSUAL_VALUE,
                f"{stage.name}: the coefficient of friction is {friction:g}; usual: {low:g} to "
                f"{high:g}",
            )


def friction_step_warnings(
    stages: Sequence[FaceContact], first: Sequence[FirstContact], state: CoupledState[Any]
) -> Iterator[Notice]:
    """Yield the warnings for contacts whose friction changes faster than the run follows.

    Wear jumps are divided where friction changes, down to single cycles. The loads of a structure
    are solved again after a jump only.
    """
    for stage, found, energy in zip(stages, first, state.kinetics[:, :, -1].T, strict=True):
        cycle = _friction_change(stage, [0.0, float(found.energy.sum())])
        jumps = _friction_change(stage, energy)
        solved_after_jumps = not isinstance(stage.contact, InterfaceContact) or (
            state.solutions > 1 and any(face.pressed.size for face in state.interfaces)
        )
        if cycle is not None:
            _, before, after = cycle
            yield Notice(
                WarningKind.FRICTION_CHANGES,
                f"{stage.name}: friction changes from {before:.3g} to {after:.3g} within the first "
                "cycle, and cycles are not divided: energy and wear may be wrong; let friction "
                "change over more energy",
            )
        elif jumps is not None and solved_after_jumps:
            jump, before, after = jumps
            yield Notice(
                WarningKind.FRICTION_CHANGES,
                f"{stage.name}: friction changes from {before:.3g} to {after:.3g} within the wear "
                f"jump to {state.cycles[jump + 1]:.3g} cycles, in which the loads stay those of "
                "its beginning: energy and wear may be wrong; give smaller jumps",
            )


def _friction_change(
    stage: FaceContact, energy: Sequence[float]
) -> tuple[int, float, float] | None:
    """Return where friction changes most between energies, before and after; None if it is little.

    The place is the number of the change, which counts by the largest friction.
    """
    friction = np.array([stage.settings.friction(float(e)) for e in energy])
    change = np.abs(np.diff(friction))
    if not change.max(initial=0.0) > LARGEST_CHANGE * friction.max():
        return None
    place = int(np.argmax(change))
    return place, float(friction[place]), float(friction[place + 1])


def open_warnings(name: str, carried: Array, peak: int) -> Iterator[Notice]:
    """Yield the warning for a contact that carries nothing at all, or nothing at ``peak`` load.

    ``carried`` ``(t,)`` is the load of every increment in any unit.
    """
    if carried.max() <= 0.0:
        yield Notice(WarningKind.FACE_OPEN, f"{name} is never closed: it does not wear")
    elif carried[peak] <= 0.0:
        yield Notice(
            WarningKind.FACE_OPEN,
            f"{name} is open at peak load: there is no pressure and no stress to show there",
        )


def unpressed_warnings(
    stages: Sequence[FaceContact], first: Sequence[FirstContact], peak: int
) -> Iterator[Notice]:
    """Yield the warnings of :func:`open_warnings` for all contacts, by their pressures."""
    for stage, found in zip(stages, first, strict=True):
        yield from open_warnings(stage.name, found.pressure.sum(axis=(1, 2)), peak)


def dissimilar_warnings(
    stages: Sequence[FaceContact], first: Sequence[FirstContact]
) -> Iterator[Notice]:
    """Yield the warning for slips of the loads on dissimilar bodies."""
    unlike = [
        stage.pair
        for stage in stages
        if isinstance(stage.contact, InterfaceContact)
        and stage.settings.method == "normal"
        and not stage.pair.similar
    ]
    if not unlike:
        return
    pair = max(unlike, key=lambda pair: abs(pair.dundurs_beta))
    linked = all(found.link.corrects for found in first)
    has = "resolves only as far as the mesh does" if linked else "neglects"
    yield Notice(
        WarningKind.DISSIMILAR_NEGLECTED,
        f"the materials differ (Dundurs' beta {pair.dundurs_beta:.2g}), so shear moves the "
        f"surfaces normally, which method normal of the contact {has}: use full",
    )


def yield_warnings(highest: float, bodies: Iterable[Material], where: str = "") -> Iterator[Notice]:
    """Yield the warning for a ``highest`` pressure [MPa] above the yield stress of a body.

    ``where`` begins its text.
    """
    limit = min(body.yield_stress for body in bodies)
    if highest > limit:
        yield Notice(
            WarningKind.PRESSURE_ABOVE_YIELD,
            f"{where}the pressure reaches {highest:.0f} MPa, above the yield stress of "
            f"{limit:.0f} MPa: the elastic solution is no longer valid there",
        )


def link_warnings(name: str, link: StructureLink) -> Iterator[Notice]:
    """Yield the warning for an uncertain link of a contact to its structure."""
    if not link.corrects or not link.coarse:
        return
    _, misfit, graininess = link.quality.tolist()
    why = (
        "the mesh is too coarse"
        if link.grainy
        else "the deformation changes within fewer nodes than a fit can follow"
    )
    yield Notice(
        WarningKind.UNCERTAIN_LINK,
        f"{name}: the link to the structure has errors of {100.0 * misfit:.2g} % (smooth) and "
        f"{100.0 * graininess:.2g} % (grainy) of the deformation of half-spaces, and pressures may "
        f"be wrong by as much: {why}; refine the mesh of the contact face",
    )


def instability_warnings(faces: WornFaces, cycles: float) -> Iterator[Notice]:
    """Yield the warning for explicit steps of more ``cycles`` than is stable."""
    stable = min(stage.contact.stable_cycles(state) for stage, state in faces)
    if cycles > stable:
        yield Notice(
            WarningKind.UNSTABLE_STEPS,
            f"explicit wear steps above {stable:.3g} cycles amplify the roughness of the grid: use "
            "implicit or smaller steps",
        )


def growth_warnings(faces: WornFaces) -> Iterator[Notice]:
    """Yield the warnings for half-space contacts that have worn up to the border of their grid."""
    for stage, state in faces:
        worn = state.surfaces.depth
        if worn[[0, -1], :].any() or (not stage.grid.line and worn[:, [0, -1]].any()):
            yield stage.border_warning


def weightless_warnings(bodies: Mapping[str, Material]) -> Iterator[Notice]:
    """Yield the warnings for ``bodies`` without density that rotation or acceleration loads."""
    for name, material in bodies.items():
        if material.density == 0.0:
            yield Notice(
                WarningKind.NO_DENSITY,
                f"{name} has no density, so the forces of its own mass under rotation or "
                "acceleration are missing: give its material one",
            )
