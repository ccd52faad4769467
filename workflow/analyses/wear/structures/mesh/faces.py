"""Outline and checks of the contact faces of a mesh before a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe_models.meshes.structure_mesh import Interface, StructureMesh
from workflow.analyses.wear.case.gaps import Gap, HeightsGap
from workflow.analyses.wear.case.scanned import MIRRORED
from workflow.case.files.input_files import read_heights
from workflow.case.sections import Section, disagreement
from workflow.case.text.plain import counted, shape_in_words
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.faces import face_size, planes_of_symmetry

# Relative rounding error of shared areas; and the least shared part of the smaller face, which may
# lack the clearance of a bolt hole, an eighth of the area under the head.
SHARED, WHOLE = 1e-6, 0.8


def outline_of(mesh: StructureMesh, interface: Interface, gap: Section | None) -> str:
    """Return a description of an interface and its added gap for the outline before a run."""
    meet = "meet node to node" if interface.projection is None else "do not match"
    area = f"{interface.nodal_areas.sum():.4g} {_unit(interface)}"
    # Rounded, because planes of a mesh file differ in the last digits.
    low, high = (round(float(gap), 9) + 0.0 for gap in (interface.gap.min(), interface.gap.max()))
    more = "" if gap is None else f" and {shape_in_words(gap)}"
    cut = ""
    if interface.planes:
        x, y = face_size(interface)
        whole = f"{x:.4g} mm" if interface.line else f"{x:.4g} x {y:.4g} mm"
        cut = (
            f"; cut by {planes_of_symmetry(interface.planes)}, on a grid over the whole face, "
            f"{whole}"
        )
    return (
        f"{interface.name}, {len(interface)} nodes that {meet}, {area}{_beside(mesh, interface)}, "
        f"gap of the meshes {low:.3g} to {high:.3g} mm{_curved(interface)}{more}{cut}"
    )


def _unit(interface: Interface) -> str:
    """Return the unit of areas, or of lengths in a line contact."""
    return "mm" if interface.line else "mm²"


def _areas(mesh: StructureMesh, interface: Interface) -> tuple[float, float, float]:
    """Return shared and whole areas of an interface [mm²]; lengths [mm] of a line contact.

    Areas are projected along the normal.
    """
    z = interface.frame.axes[2]
    bodies = (mesh.bodies[place] for place in interface.bodies)
    whole = [float(np.abs(body.outward(interface.name) @ z).sum()) for body in bodies]
    return float(interface.nodal_areas.sum()), whole[0], whole[1]


def _beside(mesh: StructureMesh, interface: Interface) -> str:
    """Return the whole areas of both faces, in words, if they are not fully shared."""
    shared, *whole = _areas(mesh, interface)
    if all(abs(area / shared - 1.0) < SHARED for area in whole):
        return ""
    return f" of {whole[0]:.4g} and {whole[1]:.4g} {_unit(interface)}"


def _curved(interface: Interface) -> str:
    """Return how far the surfaces are off the facets of their meshes, and the source, in words."""
    parts = []
    for number in (1, 2):
        surface = interface.face(number).surface
        bulge = 0.0 if surface is None else float(np.abs(surface.bulges).max(initial=0.0))
        if surface is None or round(bulge, 9) == 0.0 == surface.straight:
            continue
        fit = f"fitted through nodes, to {1e3 * surface.error:.2g} µm"
        how = "by nodes on edges" if surface.form_error is None else fit
        bent = f", {counted(surface.straight, 'edge')} left straight" * (surface.straight > 0)
        parts.append(f"body {number} up to {1e3 * bulge:.3g} µm off its facets ({how}{bent})")
    return f", {' and '.join(parts)}" if parts else ""


def hardly_met(mesh: StructureMesh, interface: Interface) -> Notice | None:
    """Return a plausibility warning about faces that share little, if they do."""
    shared, *whole = _areas(mesh, interface)
    if shared >= WHOLE * min(whole):
        return None
    return Notice(
        WarningKind.FACES_HARDLY_MEET,
        f"{interface.name}: its faces share only {shared:.4g} {_unit(interface)} of "
        f"{whole[0]:.4g} and {whole[1]:.4g}: if a face has several parts, name them all, as in "
        "face_2: [a, b]",
    )


def check_mirrored(gap: Gap, planes: Sequence[int], key: str) -> None:
    """Refuse heights that are not symmetric about the ``planes`` that cut their face."""
    if not isinstance(gap, HeightsGap):
        return
    heights = read_heights(gap.file)
    for axis in planes:
        apart = np.abs(heights - np.flip(heights, axis)).max()
        if apart > MIRRORED * np.ptp(heights):
            raise disagreement(
                f"{gap.file}: not symmetric about {planes_of_symmetry([axis])}, it differs by up "
                f"to {apart:.3g} mm; allowed: symmetric heights over the whole face, or a mesh of "
                "it",
                key,
            )
