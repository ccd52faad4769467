"""What all figures share: size, type and colours, and how one is begun and written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from workflow.shell.store import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH_INCHES, DOTS_PER_INCH = 12.0, 100
FONT_SIZE = 13
STYLE: dict[Any, Any] = {
    "font.size": FONT_SIZE,
    "axes.titlesize": 13,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.alpha": 0.3,
    "legend.fontsize": 11,
    "legend.framealpha": 0.85,
    "figure.titlesize": 15,
    "lines.linewidth": 1.8,
}
# Okabe and Ito's colours, which colour-blind readers distinguish too.
BLUE, ORANGE, GREEN, PURPLE, BLACK = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#222222"


def save(figure: Figure, path: Path) -> None:
    """Write ``figure``; it appears under its name only when it is complete."""
    with replacing(path) as partial:
        figure.savefig(partial, format="png", dpi=DOTS_PER_INCH)


def new_figure(title: str, height: float) -> Figure:
    """An empty figure with a title, ``height`` in inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_INCHES, height), layout="constrained")
    figure.suptitle(title, fontweight="bold")
    return figure
