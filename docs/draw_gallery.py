"""Pictures of the gallery, drawn from runs of the shipped cases.

They are drawn by `make docs-gallery`, or by

    python docs/draw_gallery.py RUNS [CASE ...]

Runs that are not finished below RUNS are computed first, which takes about 20 minutes on one core
for all cases. The figure of each that docs/gallery/scenes.yaml names is drawn again from the
results with the current program, and stored at a small size next to that file.
"""

from __future__ import annotations

import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
from PIL import Image
from ruamel.yaml import YAML

from workflow.kinds import analysis_of, load_case
from workflow.pictures.style import write_figures
from workflow.shell.output.results import read_contents

ROOT = Path(__file__).parent.parent
GALLERY = ROOT / "docs" / "gallery"
WIDTH = 900
# Palette sizes; the first that makes a small enough file is used. A palette that is chosen for its
# spread and then fitted keeps the colours of lines distinct although they have few pixels.
COLOURS, FITTED = (128, 64, 48), 3
LARGEST = 60_000  # bytes


def main(runs: Path, names: list[str]) -> None:
    """Store the pictures of the cases named, or of all."""
    scenes = YAML(typ="safe").load(GALLERY / "scenes.yaml")
    for name in names or scenes:
        if not (runs / name / "summary.json").exists():
            case = ROOT / "cases" / f"{name}.yaml"
            command = ["fretscale", "run", str(case), "--out", str(runs / name), "--force"]
            subprocess.run(command, check=True)
        store_anew(runs / name, scenes[name]["figure"], GALLERY / f"{name}.png")


def store_anew(run: Path, figure: str, small: Path) -> None:
    """Draw a figure of a finished run from its results, and store it at a small size."""
    results, pictures = run / "results.h5", analysis_of(load_case(run / "case.yaml")).pictures()
    contents = read_contents(results, pictures.contents)
    with TemporaryDirectory() as folder, h5py.File(results) as file:
        draw = partial(pictures.figures_of(contents)[figure], file)
        (picture,) = write_figures([(figure, draw)], Path(folder))
        store(picture, small)


def store(picture: Path, small: Path) -> None:
    """Store a figure with a width and a palette that make tens of kilobytes."""
    with Image.open(picture) as image:
        height = round(image.height * WIDTH / image.width)
        scaled = image.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS)
    for colours in COLOURS:
        how = {"method": Image.Quantize.MAXCOVERAGE, "kmeans": FITTED, "dither": Image.Dither.NONE}
        scaled.quantize(colours, **how).save(small, optimize=True)
        if small.stat().st_size < LARGEST:
            return


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
