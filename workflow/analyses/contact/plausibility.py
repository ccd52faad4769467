"""Plausibility warnings about two bodies under loads: pressure, shear and grid."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sa_solver.types import Array
from workflow.case.plausibility import pressed
from workflow.case.sections import ElasticSection
from workflow.case.text.plain import plain
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.uncoupled.load_table import LoadTable

# Shear below this share of the friction limit is hardly intended.
HARDLY = 1e-3
# Least number of cells across a contact with which the grid resolves it at all.
FEWEST = 2.0
# Step at the border of repeated heights over that between most neighbouring rows of cells. Rows of
# rough surfaces differ among each other by less than twice.
STEP = 4.0
# Rounding of forces that are meant to reach the limit of friction.
ROUNDING = 1e-9


def about_pressure(
    path: str, pressure: float, bodies: Sequence[ElasticSection | str]
) -> Iterator[Notice]:
    """Warn about the largest pressure [MPa] under the loads, compared with the bodies' strength."""
    elastic = [body for body in bodies if isinstance(body, ElasticSection)]
    limits = [getattr(body, "yield_stress", None) for body in elastic]
    yield from pressed(path, pressure, limits, [body.elastic().young for body in elastic])


def about_grid(width: float, sides: Sequence[float], cells: Sequence[int]) -> Iterator[Notice]:
    """Warn about a grid that is too small or too coarse for an unworn contact of ``width`` [mm]."""
    shown = f"the contact is about {plain(width, 'mm', 3)} wide"
    if width > min(sides):
        yield Notice(
            WarningKind.UNSUITABLE_GRID,
            f"contact.size: {plain(min(sides), 'mm')} is smaller than the contact ({shown}): take "
            "a larger one",
        )
    pitch = max(side / count for side, count in zip(sides, cells, strict=False) if count > 1)
    if width < FEWEST * pitch:
        yield Notice(
            WarningKind.UNSUITABLE_GRID,
            f"contact.size: cells of {plain(pitch, 'mm', 3)} are too large ({shown}): take a "
            "smaller size, or more cells in contact.grid",
        )


def about_repetition(height: Array) -> Iterator[Notice]:
    """Warn where a repeated ``height`` ``(nx, ny)`` [mm] has a step between its borders."""
    for axis, along in enumerate(("x", "y")):
        if height.shape[axis] == 1:
            continue
        across = np.diff(np.append(height, height.take([0], axis), axis), axis=axis)
        sizes = np.sqrt(np.nanmean(np.where(np.isfinite(across), across, np.nan) ** 2, 1 - axis))
        step, usual = float(sizes[-1]), float(np.median(sizes[:-1]))
        if step > STEP * usual:
            yield Notice(
                WarningKind.UNSUITABLE_GRID,
                f"contact.boundary: along {along} the repeated heights have a step of "
                f"{plain(step, 'mm', 2)} between opposite borders, and neighbouring cells differ "
                f"by {plain(usual, 'mm', 2)} (root mean squares): the contact presses on a step "
                "that the surface does not have; take heights that fade into each other, or free",
            )


def about_shear(path: str, table: LoadTable, friction: float, unit: str) -> Iterator[Notice]:
    """Warn about tangential forces, compared with the friction limit, where P is imposed."""
    forces = {"Qx", "Qy"} & table.columns.keys()
    if not forces or "P" not in table.columns:
        return
    shear: Array = np.hypot(table["Qx"], table["Qy"])
    carried = friction * table["P"]
    largest = int(np.argmax(shear - carried))
    names = " and ".join(sorted(forces))
    if shear[largest] > (1.0 + ROUNDING) * carried[largest]:
        yield Notice(
            WarningKind.FRICTION_EXCEEDED,
            f"{path}: {names} of {plain(float(shear[largest]), unit, 3)} exceed what friction "
            f"carries, {plain(float(carried[largest]), unit, 3)}: the run would end there",
        )
    elif 0.0 < shear.max() < HARDLY * carried.max():
        yield Notice(
            WarningKind.UNUSUAL_LOAD,
            f"{path}: {names} up to {plain(float(shear.max()), unit, 3)} are far below what "
            f"friction carries, {plain(float(carried.max()), unit, 3)}: is the unit right?",
        )
