"""ParaView files of a vibration case: the pad through a cycle at resonance, one series per force.

``cycle_<n>.pvd`` is over the time of a cycle [s]. Every step is a mesh of the pad
(``cycle_<n>/<step>.vtu``) with its fields at the nodes. Vectors are in the interface frame: body 2
relative to body 1, and the force of body 1 on body 2. Warp By Vector on ``vibration``, which is
``displacement`` less its mean over the cycle, shows the vibration. The axes of the face are the
global axes of these files. ``view.py`` shows the largest force. ``state`` is 0 where a node sticks,
1 where it slips and 2 where it is apart. It has no meaning between the nodes, so show it on points
or glyphs.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from sa_solver.types import Array
from workflow.analyses.vibration.case.excitation import amount_in
from workflow.analyses.vibration.case.pad_nodes import rows_and_columns
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.view import FIRST, PictureScene, Shown, View, write_view
from workflow.pictures.vtk import SECONDS, Fields, Step, attach, quadrilaterals, write_series

if TYPE_CHECKING:
    import pyvista

# Number of steps that play smoothly and use little disk space.
MOST_STEPS = 48
# A joint counts its closing as positive, which moves body 2 along -z. It resists: its force on body
# 2 is opposite to the displacement.
TO_FRAME = np.array([1.0, 1.0, -1.0])


def write_vibration(contents: VibrationContents, file: h5py.File, folder: Path) -> list[Path]:
    """Write the cycle of every force and the script, and return the paths.

    Writes nothing where joints have no places.
    """
    if not contents.places:
        return []
    written: list[Path] = []
    for number in contents.responses:
        cycle = _cycle(file["contact"], file["responses"][number], folder / f"cycle_{number}")
        written += write_series(folder / f"cycle_{number}.pvd", SECONDS, cycle)
    return [*written, _write_view(contents, file, folder)]


def _write_view(contents: VibrationContents, file: h5py.File, folder: Path) -> Path:
    """Write the script that shows the cycle under the largest force, and return its path."""
    largest = max(contents.responses, key=lambda n: amount_in(file["responses"][n].attrs)[1])
    series, motion = f"cycle_{largest}.pvd", "vibration [mm]"
    views = [
        View("Contact pressure", [Shown(series, "pressure [MPa]", motion)]),
        View("Vibration", [Shown(series, motion, motion)]),
    ]
    scene = PictureScene(str(file.attrs["title"]), SECONDS, 0.0, views)
    return write_view(scene, folder / FIRST)


def _cycle(contact: h5py.Group, response: h5py.Group, folder: Path) -> Iterator[Step]:
    cycle, frequency = response["resonance"], float(response.attrs["resonance"])
    count = len(cycle["state"])
    mean = TO_FRAME * cycle["displacement"][()].mean(axis=0)
    for number, step in enumerate(shown_samples(count)):
        mesh = pad_mesh(contact)
        attach(mesh.point_data, _fields(contact, cycle, step, mean))
        yield step / count / frequency, "pad", folder / f"{number:03d}.vtu", mesh


def shown_samples(count: int) -> range:
    """Return the samples of a cycle to show, in even steps that divide the cycle if possible.

    >>> shown_samples(256)
    range(0, 256, 8)
    """
    least = -(-count // MOST_STEPS)
    return range(0, count, next((n for n in range(least, 2 * least) if count % n == 0), least))


def _fields(contact: h5py.Group, cycle: h5py.Group, step: int, mean: Array) -> Fields:
    displacement = TO_FRAME * cycle["displacement"][step]
    force = -TO_FRAME * cycle["force"][step]
    return {
        "displacement": (displacement, "mm"),
        "vibration": (displacement - mean, "mm"),
        "force": (force, "N"),
        "pressure": (force[:, 2] / contact["area"][()], "MPa"),
        "gap": (contact["gap"][()] + displacement[:, 2], "mm"),
        "area": (contact["area"][()], "mm^2"),
        "state": (cycle["state"][step], "1"),
    }


def pad_mesh(places: h5py.Group) -> pyvista.UnstructuredGrid:
    """Return quadrilaterals between the nodes, or the nodes alone if not in rows and columns."""
    import pyvista

    x, y = places["x"][()], places["y"][()]
    points = np.stack([x, y, np.zeros_like(x)], axis=1)
    numbers = rows_and_columns(x, y)
    if numbers is None:
        vertices = np.arange(len(x))[:, None]
        return pyvista.UnstructuredGrid({pyvista.CellType.VERTEX: vertices}, points)
    return pyvista.UnstructuredGrid({pyvista.CellType.QUAD: quadrilaterals(numbers)}, points)
