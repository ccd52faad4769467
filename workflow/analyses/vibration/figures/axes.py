"""What the figures of a vibration case share."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Of a decade: further numbers would touch each other.
TICKS = (2.0, 5.0)


def plain_ticks(axis: Axes) -> None:
    """Plain numbers along a logarithmic x axis, few of them."""
    from matplotlib.ticker import LogLocator

    axis.xaxis.set_minor_locator(LogLocator(subs=TICKS))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter("{x:g}")
