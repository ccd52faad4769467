"""Figures of the theory and of README, drawn from runs.

They are drawn by `make docs-figures`, or by

    python docs/draw_figures.py RUNS [FIGURE ...]

The command of each figure is listed with it, and takes up to half an hour. Finished runs below RUNS
are reused, and only their figures are drawn again.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

from draw_gallery import ROOT, store, store_anew

# The figure of the run that is used, and the command.
FIGURES = {
    "pressure_profiles": ("pressure_profiles", "run cases/dovetail.yaml"),
    "rig_response": ("frequency_response", "run cases/rig_harmonic_balance.yaml"),
    "chart_grid": ("chart_grid", "chart cases/sphere_fretting.yaml --axis grid"),
    "chart_stepper": ("chart_stepper", "chart cases/dovetail_2d.yaml --axis stepper"),
    "chart_increments": ("chart_increments", "chart cases/dovetail_2d.yaml --axis increments"),
    "chart_link": ("chart_link", "chart cases/dovetail_2d.yaml --axis link"),
    "chart_harmonics": (
        "chart_harmonics",
        "chart cases/rig_two_dof.yaml --axis harmonics --set 'forces=[10 N, 50 N]' "
        "--set 'loops={frequency: 100 Hz}'",
    ),
    "li_figure_13": ("bands_over_energy", "sweep cases/sweeps/bolted_joint_test4.yaml"),
}


def main(runs: Path, names: list[str]) -> None:
    """Store the figures named, or all."""
    for name in names or FIGURES:
        figure, command = FIGURES[name]
        if not (runs / name / "summary.json").exists():
            arguments = ["fretscale", *shlex.split(command), "--out", str((runs / name).resolve())]
            subprocess.run(arguments, check=True, cwd=ROOT)
        small = ROOT / "docs" / "figures" / f"{name}.png"
        if command.startswith("run "):
            store_anew(runs / name, figure, small)
        else:
            store(runs / name / "figures" / f"{figure}.png", small)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
