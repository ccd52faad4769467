"""The look of all figures: type and colours; and how they are written."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from workflow.shell.store import replacing

DOTS_PER_INCH = 100
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
SKY, AMBER = "#56B4E9", "#E69F00"
# Of fields, and of curves in an order; its end is too bright for lines.
COLOUR_MAP, LAST_SHADE = "viridis", 0.9
# Of panels that begin at 0, over the largest value.
HEADROOM = 1.1


def write_figures(figures: Iterable[tuple[str, Callable[[], Figure]]], folder: Path) -> list[Path]:
    """Draw figures, given by their names, as PNG files; returns their paths.

    Each appears under its name only when it is complete.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    with rc_context(STYLE):
        for name, draw in figures:
            path = folder / f"{name}.png"
            figure = draw()
            _lay_out(figure)
            with replacing(path) as partial:
                figure.savefig(partial, format="png", dpi=DOTS_PER_INCH)
            written.append(path)
    return written


def _lay_out(figure: Figure) -> None:
    """Give everything its place for good: to save a figure with a layout would draw it twice."""
    engine = figure.get_layout_engine()
    if engine is not None:
        figure.set_dpi(DOTS_PER_INCH)
        engine.execute(figure)
        figure.set_layout_engine("none")
