"""Names next to the marks of a figure, as many as there is room for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

Place = tuple[float, float]

NAME_SIZE = 9
# Offsets [points] and alignment of a name from its mark; the first free one is used.
BESIDE: tuple[tuple[int, int, str], ...] = (
    (10, 6, "left"),
    (10, -14, "left"),
    (-10, 6, "right"),
    (-10, -14, "right"),
    (12, -4, "left"),
    (-12, -4, "right"),
)
# Half the width of a mark [pixels].
HALF_MARK = 5.0


def name_marks(axis: Axes, names: Iterable[tuple[str, Place]], marks: Sequence[Place]) -> None:
    """Write each name next to its place, clear of all ``marks`` and of earlier names.

    Names without room are left out, so the most important ones must come first. The layout of the
    figure must be computed before.
    """
    taken = [_box(axis, place) for place in marks]
    for name, place in names:
        for across, up, side in BESIDE:
            text = axis.annotate(
                name,
                place,
                (across, up),
                textcoords="offset points",
                fontsize=NAME_SIZE,
                ha=side,
            )
            text.set_in_layout(False)
            box = text.get_window_extent()
            if _inside(box, axis.bbox) and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                break
            text.remove()


def _box(axis: Axes, place: Place) -> Bbox:
    """Return the box of a mark [pixels]."""
    x, y = axis.transData.transform(place)
    return Bbox.from_extents(x - HALF_MARK, y - HALF_MARK, x + HALF_MARK, y + HALF_MARK)


def _inside(box: Bbox, room: Bbox) -> bool:
    return bool(box.x0 >= room.x0 and box.x1 <= room.x1 and box.y0 >= room.y0 and box.y1 <= room.y1)
