"""Pictures of the gallery, from runs of the shipped cases: `make docs-gallery`, or

    python docs/draw_gallery.py RUNS [CASE ...]

Runs that are not finished below RUNS are computed there first: about 20 minutes of one core for all
of them. Of each the figure that docs/gallery/scenes.yaml names is drawn anew from its results, as
the program draws it now, and stored, small, beside it.
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
from workflow.shell.results import read_contents

ROOT = Path(__file__).parent.parent
GALLERY = ROOT / "docs" / "gallery"
WIDTH = 900
# Of a palette, the first that is small enough. Chosen for its spread and then fitted, it keeps the
# colours of lines apart, which have few dots.
COLOURS, FITTED = (128, 64, 48), 3
LARGEST = 60_000  # bytes


def main(runs: Path, names: list[str]) -> None:
    """Store the pictures of the cases named, of all if none is."""
    scenes = YAML(typ="safe").load(GALLERY / "scenes.yaml")
    for name in names or scenes:
        if not (runs / name / "summary.json").exists():
            case = ROOT / "cases" / f"{name}.yaml"
            command = ["fretscale", "run", str(case), "--out", str(runs / name), "--force"]
            subprocess.run(command, check=True)
        store_anew(runs / name, scenes[name]["figure"], GALLERY / f"{name}.png")


def store_anew(run: Path, figure: str, small: Path) -> None:
    """A figure of a finished run, drawn from its results."""
    results, pictures = run / "results.h5", analysis_of(load_case(run / "case.yaml")).pictures()
    contents = read_contents(results, pictures.contents)
    with TemporaryDirectory() as folder, h5py.File(results) as file:
        draw = partial(pictures.figures_of(contents)[figure], file)
        (picture,) = write_figures([(figure, draw)], Path(folder))
        store(picture, small)


def store(picture: Path, small: Path) -> None:
    """A figure in a width and in colours that make tens of kilobytes."""
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
