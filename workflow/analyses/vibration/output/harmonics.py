"""Motions by their harmonics: complex coefficients of every place and joint."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray
from sa_solver.types import Array
from workflow.analyses.vibration.output.layout import CONVENTION
from workflow.analyses.vibration.output.outcome import Response
from workflow.layout.declared import Arrays
from workflow.models.rig.rig_model import RigModel
from workflow.shell.output.tables import DIGITS, write_table
from workflow.shell.terminal.reporter import Reporter

MEGABYTE = 1e6
# Columns of the table of harmonics.
HEADINGS = (
    *("frequency [Hz]", "motion", "harmonic", "of", "name"),
    *("displacement_real [mm]", "displacement_imaginary [mm]"),
    *("force_real [N]", "force_imaginary [N]"),
)


def names_of(rig: RigModel) -> Arrays:
    """Return names of the places ``(p,)`` and of the joints' directions ``(j, d)``."""
    places = np.array([rig.model.names[place] for place in rig.retained], dtype=np.bytes_)
    joints = np.array(rig.stretched, dtype=np.bytes_).reshape(rig.joints, rig.directions)
    return {"places": places, "joints": joints}


def harmonics_of(rig: RigModel, motion: HarmonicSolution) -> Arrays:
    """Return coefficients ``(k, p)`` of places and ``(k, j, d)`` of joints, of one motion."""
    orders, parts = motion.resolution.harmonics, _coefficients(rig, motion)
    return {
        "frequency": np.array(motion.frequency),
        **_arrays(np.array(orders), parts),
    }


def harmonics_along(rig: RigModel, branch: ResponseBranch, reporter: Reporter) -> Arrays:
    """Return coefficients of all points of a curve, with the points along the first axis.

    Harmonics that a motion does not have are 0.
    """
    orders = branch.problem.resolution.harmonics
    along: list[list[ComplexArray]] = []
    for motion in branch.solutions:
        rows = [orders.index(order) for order in motion.resolution.harmonics]
        every = []
        for part in _coefficients(rig, motion):
            widened = np.zeros((len(orders), *part.shape[1:]), dtype=complex)
            widened[rows] = part
            every.append(widened)
        along.append(every)
    parts = tuple(np.array(part) for part in zip(*along, strict=True))
    size = sum(part.nbytes for part in parts) / MEGABYTE
    reporter.log(f"harmonics along the curve: {size:.3g} MB before they are packed")
    return {"frequency": branch.frequencies, **_arrays(np.array(orders), parts)}


def _coefficients(rig: RigModel, motion: HarmonicSolution) -> tuple[ComplexArray, ...]:
    """Return coefficients of places, and of the displacement and force of joints."""
    resolution, shape = motion.resolution, (-1, rig.joints, rig.directions)
    moved, pulled = (
        resolution.amplitudes(part).reshape(shape)
        for part in (motion.coefficients, motion.cycle.force)
    )
    return motion.motion[:, rig.retained], moved, pulled


def _arrays(orders: Array, parts: tuple[ComplexArray, ...]) -> Arrays:
    places, moved, pulled = parts
    return {
        "harmonic": orders,
        "displacement": places,
        "joint_displacement": moved,
        "joint_force": pulled,
    }


# --- table --------------------------------------------------------------------------------------


def write_harmonics(path: Path, names: Arrays, response: Response) -> None:
    """Write the motions at resonance and at the frequencies of the case, one harmonic per row.

    Motions at frequencies of the case are counted from 1, as the rows of their table.
    """
    rows = [
        row
        for group, values in response.harmonics.items()
        if group != "curve"
        for row in _rows(group, values, names)
    ]
    columns = dict(zip(HEADINGS, zip(*rows, strict=True), strict=True))
    write_table(path, columns, DIGITS, note=f"{CONVENTION}; against the ground")


def _rows(group: str, values: Arrays, names: Arrays) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of one motion; the forces of places stay empty."""
    motion = "resonance" if group == "resonance" else str(int(group.rpartition("_")[2]) + 1)
    places, joints = (names[kind].ravel().tolist() for kind in ("places", "joints"))
    for k, order in enumerate(values["harmonic"].tolist()):
        begin = float(values["frequency"]), motion, order
        for name, moved in zip(places, values["displacement"][k], strict=True):
            yield *begin, "place", name.decode(), *_parts(moved), "", ""
        both = (values[f"joint_{name}"][k].ravel() for name in ("displacement", "force"))
        for name, moved, pulled in zip(joints, *both, strict=True):
            yield *begin, "joint", name.decode(), *_parts(moved), *_parts(pulled)


def _parts(number: complex) -> tuple[float, float]:
    return float(number.real), float(number.imag)
