"""Figure layout without cut texts: long texts are broken into lines, legends into rows."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from matplotlib.figure import Figure, FigureBase
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.text import Text

# Share of the available width that a line may fill, since letters differ in width.
FILLED = 0.97
# Smallest number of letters in a line, however narrow its panel.
FEWEST_LETTERS = 8
# Largest number of passes: titles of more lines make maps smaller, and hence titles narrower.
MOST_LAYOUTS = 4


class FittedLayout(ConstrainedLayoutEngine):
    """Constrained layout that breaks titles and labels longer than their panels into lines.

    The widths of panels are found first, by layouts without and then with broken lines.
    """

    def __init__(self, **parameters: Any) -> None:
        super().__init__(**parameters)
        self._words: dict[Text, str] = {}

    def execute(self, fig: Any) -> None:
        """Lay out the figure, and repeat this if lines had to be broken."""
        for _ in range(MOST_LAYOUTS):
            super().execute(fig)
            if not self._fit(fig):
                break

    def _fit(self, figure: Figure) -> bool:
        """Break texts that are too long for their place; return whether there were any."""
        found = [self._break(text, room) for text, room in _texts(figure)]
        return any([*found, *(_narrow(legend, room) for legend, room in _legends(figure))])

    def _break(self, text: Text, room: float) -> bool:
        """Break a text into lines no longer than ``room`` [pixels]; return whether it was."""
        if not text.get_text() or not text.get_visible():
            return False
        box = text.get_window_extent()
        length = box.height if text.get_rotation() == 90.0 else box.width
        if length <= room:
            return False
        shown, words = text.get_text(), self._words.setdefault(text, text.get_text())
        longest = max(map(len, shown.split("\n")))
        lines = broken(words, max(FEWEST_LETTERS, int(FILLED * room / length * longest)))
        text.set_text(lines)
        return lines != shown


def _texts(figure: Figure) -> Iterator[tuple[Text, float]]:
    """Yield titles and labels with the width available for their lines [pixels]."""
    for part in _parts(figure):
        for text in part.texts:
            yield text, part.bbox.width  # type: ignore[attr-defined]
    for axis in figure.axes:
        yield axis.title, axis.bbox.width
        yield axis._left_title, axis.bbox.width  # type: ignore[attr-defined]
        yield axis.xaxis.label, axis.bbox.width
        yield axis.yaxis.label, axis.bbox.height


def _parts(figure: FigureBase) -> Iterator[FigureBase]:
    """Yield a figure and all its subfigures."""
    yield figure
    for part in figure.subfigs:
        yield from _parts(part)


def _legends(figure: Figure) -> Iterator[tuple[Legend, float]]:
    """Yield the legends of whole figures with the width available for them [pixels]."""
    for part in _parts(figure):
        for legend in part.legends:
            yield legend, part.bbox.width  # type: ignore[attr-defined]


def broken(words: str, letters: int) -> str:
    """Break a text into lines of at most ``letters`` letters, after spaces.

    A word longer than a line is broken after ``_`` and ``/``, and its parts, where they are still
    too long, anywhere.
    """
    lines = []
    for paragraph in words.split("\n"):
        line = ""
        for piece in _pieces(paragraph, letters):
            if line and len(line) + len(piece.rstrip()) > letters:
                lines.append(line)
                line = ""
            while len(piece.rstrip()) > letters:
                lines.append(piece[:letters])
                piece = piece[letters:]
            line += piece
        lines.append(line)
    return "\n".join(line.rstrip() for line in lines)


def _pieces(paragraph: str, letters: int) -> Iterator[str]:
    """Yield words with the spaces after them, and parts of words that are longer than a line."""
    for word in re.split(r"(?<=\s)", paragraph):
        yield from [word] if len(word.rstrip()) <= letters else re.split(r"(?<=[_/])", word)


def _narrow(legend: Legend, room: float) -> bool:
    """Reduce the columns of a legend to fit ``room`` [pixels]; return whether it was too wide."""
    before = legend._ncols  # type: ignore[attr-defined]
    while legend._ncols > 1 and legend.get_window_extent().width > room:  # type: ignore[attr-defined]
        legend.set_ncols(legend._ncols - 1)  # type: ignore[attr-defined]
    return bool(legend._ncols != before)  # type: ignore[attr-defined]
