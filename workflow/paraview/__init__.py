"""Results for ParaView.

Lengths are in mm, stresses in MPa; each array carries its unit. ``shear`` and ``slip`` are global
vectors, so that glyphs point the right way; ``shear_x``, ``shear_y``, ``slip_x`` and ``slip_y`` are
their components in the interface frame. Fields are single precision, which halves the files: the
doubles are in ``results.h5``.
"""

from __future__ import annotations

from pathlib import Path

import h5py

from workflow.paraview.contact import write_contact
from workflow.paraview.specimens import write_specimens
from workflow.paraview.vibration import write_vibration
from workflow.paraview.wear import write_wear


def write_paraview(results: Path, folder: Path) -> list[Path]:
    """Write the files that show ``results`` (a ``results.h5``) in ParaView; returns their paths.

    Every file appears under its name only when it is complete.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with h5py.File(results) as file:
        if "specimens" in file:
            return write_specimens(file, folder)
        if "responses" in file:
            return write_vibration(file, folder)
        write = write_contact if "history" in file else write_wear
        return write(file, folder)
