"""Pictures of the gallery, from runs of the shipped cases: `make docs-gallery`, or

    python docs/draw_gallery.py RUNS [CASE ...]

Runs that are not finished below RUNS are computed there first: about 20 minutes of one core for all
of them. Of each the figure that docs/gallery/scenes.yaml names is stored, small, beside it.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from PIL import Image
from ruamel.yaml import YAML

ROOT = Path(__file__).parent.parent
GALLERY = ROOT / "docs" / "gallery"
WIDTH = 900
COLOURS = 48, 32, 24, 16  # the first that are small enough
KMEANS = 3  # rounds that bring colours of few dots back: lines and marks
LARGEST = 60_000  # bytes


def main(runs: Path, names: list[str]) -> None:
    """Store the pictures of the cases named, of all if none is."""
    scenes = YAML(typ="safe").load(GALLERY / "scenes.yaml")
    for name in names or scenes:
        picture = runs / name / "figures" / f"{scenes[name]['figure']}.png"
        if not (runs / name / "summary.json").exists():
            case = ROOT / "cases" / f"{name}.yaml"
            command = ["fretscale", "run", str(case), "--out", str(runs / name), "--force"]
            subprocess.run(command, check=True)
        store(picture, GALLERY / f"{name}.png")


def store(picture: Path, small: Path) -> None:
    """A figure in a width and in colours that make tens of kilobytes."""
    with Image.open(picture) as image:
        height = round(image.height * WIDTH / image.width)
        scaled = image.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS)
    for colours in COLOURS:
        scaled.quantize(colours, kmeans=KMEANS, dither=Image.Dither.NONE).save(small, optimize=True)
        if small.stat().st_size < LARGEST:
            return


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
