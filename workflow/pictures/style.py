"""Style of all figures (type and colours), and functions that write them."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection, QuadMesh, TriMesh
from matplotlib.figure import Figure, FigureBase
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text

from workflow.case.text.typeset import minus, typeset
from workflow.shell.folders.store import replacing

DOTS_PER_INCH = 100
# Artists with more vertices are rasterised in vector graphics, at this resolution.
DENSE, DENSE_DOTS_PER_INCH = 1000, 120
FONT_SIZE = 13
STYLE: dict[Any, Any] = {
    "font.size": FONT_SIZE,
    "axes.titlesize": 13,
    "axes.titlelocation": "left",
    "axes.grid": True,
    # Numbers at ticks have no common factor or offset, except very small and very large ones.
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-5, 7),
    "grid.alpha": 0.3,
    "legend.fontsize": 11,
    "legend.framealpha": 0.85,
    "figure.titlesize": 15,
    "lines.linewidth": 1.8,
    # Vector graphics look the same everywhere and are byte-identical for identical results.
    "svg.fonttype": "path",
    "svg.hashsalt": "fretscale",
}
# Okabe and Ito's colours, which colour-blind readers distinguish too.
BLUE, ORANGE, GREEN, PURPLE, BLACK = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#222222"
SKY, AMBER, YELLOW = "#56B4E9", "#E69F00", "#F0E442"
# Greys of lines, of areas behind lines, and of the least important part of a figure.
GREY, SHADE, PALE = "#999999", "#BBBBBB", "#E3E3E3"
# Light blue and light orange, of areas that carry other marks.
PALE_BLUE, PALE_ORANGE = "#9DC3DE", "#F2B48C"
# Colours of fields and of ordered curves; the end of the map is too bright for lines.
COLOUR_MAP, LAST_SHADE = "viridis", 0.9
# Top of panels that begin at 0, relative to the largest value.
HEADROOM = 1.1


# A product of two numbers, as in the size of a grid.
TIMES = re.compile(r"(?<=\d) x (?=\d)")

# Metadata that would contain the time of writing.
UNDATED: dict[str, dict[str, Any]] = {
    "png": {},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}


def write_figures(
    figures: Iterable[tuple[str, Callable[[], Figure]]],
    folder: Path,
    formats: Sequence[str] = ("png",),
    vectors: dict[str, str] | None = None,
) -> list[Path]:
    """Draw figures, given by their names, as files of these formats; return their paths.

    Each file appears under its name only when it is complete. If ``vectors`` is given, each figure
    is added to it as SVG text by its name.
    """
    if formats:
        folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, draw in figures:
        with rc_context(STYLE):
            figure = draw()
            _lay_out(figure)
            for kind in formats:
                path = folder / f"{name}.{kind}"
                with replacing(path) as partial:
                    _save(figure, partial, kind)
                written.append(path)
            if vectors is not None:
                vectors[name] = _as_svg(figure)
    return written


def _save(figure: Figure, target: Any, kind: str) -> None:
    dots = DOTS_PER_INCH if kind == "png" else DENSE_DOTS_PER_INCH
    named = {"Title": figure.get_suptitle()} if kind == "svg" else {}
    figure.savefig(target, format=kind, dpi=dots, metadata=UNDATED[kind] | named)


def _as_svg(figure: Figure) -> str:
    text = io.StringIO()
    _save(figure, text, "svg")
    return text.getvalue()


def _lay_out(figure: Figure) -> None:
    """Fix the layout of a figure, because saving it with a layout engine would draw it twice.

    Dense artists and shaded triangles are rasterised in vector graphics, which would otherwise be
    large and slow to show.
    """
    for text in _words(figure):
        text.set_text(TIMES.sub(" × ", typeset(text.get_text())))
    for text in _names_in_legends(figure):
        text.set_text(TIMES.sub(" × ", minus(text.get_text())))
    engine = figure.get_layout_engine()
    if engine is not None:
        figure.set_dpi(DOTS_PER_INCH)
        engine.execute(figure)
        figure.set_layout_engine(None)
    for artist in _artists(figure):
        if isinstance(artist, Collection | Line2D) and _is_dense(artist):
            artist.set_rasterized(True)


def _artists(part: FigureBase | Axes) -> Iterator[Artist]:
    """Yield the artists of a figure and its panels, except the small parts of ticks and legends.

    ``findobj`` would search these too, which takes up to a tenth of the drawing time.
    """
    for artist in part.get_children():
        yield artist
        if isinstance(artist, FigureBase | Axes):
            yield from _artists(artist)


def _words(figure: Figure) -> Iterator[Text]:
    """Yield titles and labels, in which numbers have a hyphen for the minus sign."""
    for part in (figure, *figure.subfigs):
        yield from part.texts
    for axis in figure.axes:
        yield from (axis.title, axis._left_title, axis._right_title)  # type: ignore[attr-defined]
        yield from (axis.xaxis.label, axis.yaxis.label, *axis.texts)


def _names_in_legends(figure: Figure) -> Iterator[Text]:
    """Yield the texts of legends, in which numbers may be names and remain unchanged."""
    for artist in _artists(figure):
        if isinstance(artist, Legend):
            yield from artist.get_texts()


def _is_dense(artist: Any) -> bool:
    """Return whether vector graphics would draw a line or collection slowly.

    Triangles with shaded colours always are, because SVG needs several gradients for each.
    """
    return isinstance(artist, TriMesh) or _vertices(artist) > DENSE


def _vertices(artist: Any) -> int:
    """Return approximately how many points a line or collection draws."""
    if isinstance(artist, Line2D):
        return int(np.size(artist.get_xdata(orig=False)))
    if isinstance(artist, QuadMesh):
        rows, columns, _ = np.shape(np.asarray(artist.get_coordinates()))
        return 4 * (rows - 1) * (columns - 1)
    return sum(len(path.vertices) for path in artist.get_paths())
