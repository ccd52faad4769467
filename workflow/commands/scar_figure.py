"""Figure of a measured scar: its depth from above, and on two lines through the deepest point."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sa_solver.types import Array
from wear.scar import Scar
from workflow.pictures.panels import legend_below, new_figure, rounded, volume_unit
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, COLOUR_MAP, write_figures


def write_figure(scar: Scar, name: str, path: Path) -> None:
    """Draw the scar in the scan ``name``."""
    write_figures([(path.stem, partial(figure, scar, name))], path.parent)


def figure(scar: Scar, name: str) -> Figure:
    """Draw the map with the worn area, and the depth along x and along y."""
    drawn = new_figure(f"Wear removed {_volume(scar)} ({name})", 6.0)
    left, right = drawn.subfigures(1, 2, squeeze=False, width_ratios=(1.2, 1.0))[0]
    x, y = (
        (np.arange(count) - 0.5 * (count - 1)) * pitch
        for count, pitch in zip(scar.depth.shape, scar.pitch, strict=True)
    )
    axis, depth = left.subplots(), TO_MICRONS * scar.depth
    axis.set_aspect("equal")
    shown = axis.pcolormesh(x, y, depth.T, cmap=COLOUR_MAP, rasterized=True)
    axis.contour(x, y, scar.worn.T.astype(float), levels=[0.5], colors=[BLACK])
    left.colorbar(shown, ax=axis, label="worn depth [µm]", shrink=0.8)
    axis.set(xlabel="x [mm]", ylabel="y [mm]")
    deepest = np.unravel_index(
        np.argmax(np.where(scar.worn, np.nan_to_num(scar.depth), -np.inf)), scar.depth.shape
    )
    _draw_lines(right, scar, (x, y), (int(deepest[0]), int(deepest[1])))
    return drawn


def _volume(scar: Scar) -> str:
    """Return the worn volume with its error, if that is known."""
    scale, unit = volume_unit(scar.volume)
    error = "" if scar.volume_error is None else f" ± {rounded(scale * scar.volume_error, 2)}"
    return f"{rounded(scale * scar.volume, 4)}{error} {unit}"


def _draw_lines(
    part: Figure, scar: Scar, at: tuple[Array, Array], deepest: tuple[int, int]
) -> None:
    axes = part.subplots(2, 1)
    lines = scar.depth[:, deepest[1]], scar.depth[deepest[0], :]
    inside = scar.worn[:, deepest[1]], scar.worn[deepest[0], :]
    for axis, along, depth, worn, name in zip(axes, at, lines, inside, "xy", strict=True):
        axis.plot(along, TO_MICRONS * depth, color="0.6", lw=1.0, label="outside the scar")
        axis.plot(
            along, np.where(worn, TO_MICRONS * depth, np.nan), color=BLUE, lw=1.6, label="scar"
        )
        axis.set(xlabel=f"{name} [mm]", ylabel="worn depth [µm]")
        axis.invert_yaxis()
    legend_below(part, [axes[0]])
