"""Views of the scripts for ParaView: wear over the cycles, the structure over a mission."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py

from workflow.analyses.wear.output.layout import WearContents
from workflow.pictures.view import FIRST, PictureScene, Shown, View, write_view
from workflow.pictures.vtk import CYCLES, INCREMENTS, PROFILE

DISPLACED = "displacement [mm]"
VON_MISES = "von_mises [MPa]"


def write_views(contents: WearContents, file: h5py.File, folder: Path) -> list[Path]:
    """Write the scripts and return their paths."""
    title, cycles = str(file.attrs["title"]), file["kinetics/cycles"][()]
    wear = PictureScene(title, CYCLES, float(cycles[-1]), list(_views_of_wear(contents, file)))
    written = [write_view(wear, folder / FIRST)]
    if contents.mission:
        peak = float(file.attrs["peak_increment"]) + 1.0
        views = [
            View(f"Structure, {state}", [Shown(f"mission_{state}.pvd", VON_MISES, DISPLACED)])
            for state, _ in contents.states
        ]
        mission = PictureScene(title, INCREMENTS, peak, views)
        written.append(write_view(mission, folder / "view_mission.py"))
    return written


def _views_of_wear(contents: WearContents, file: h5py.File) -> Iterator[View]:
    if contents.structure:
        yield View("Structure at peak load", [Shown("structure.pvd", VON_MISES, DISPLACED)])
    series = [(name, f"{name}.pvd") for name in contents.names]
    worn = [
        Shown(path, "depth [mm]", f"worn_{_wears_most(file, name)} [mm]") for name, path in series
    ]
    if contents.worn:
        yield View("Worn depth of both bodies", worn)
    profile = PROFILE if contents.line else ""
    pressure = [Shown(path, "pressure [MPa]", profile) for _, path in series]
    yield View("Contact pressure at peak load", pressure)
    if contents.sections:
        sections = [Shown(f"section_{name}.pvd", VON_MISES) for name in contents.names]
        yield View("Stress under the contacts", sections)


def _wears_most(file: h5py.File, interface: str) -> int:
    """Return the number of the body that is worn deepest."""
    kinetics = file["kinetics"][interface]
    return 1 if kinetics["depth_1"][-1] >= kinetics["depth_2"][-1] else 2
