"""Figure of a measured scar: its depth from above, and on two lines through the deepest point."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sa_solver.types import Array
from wear.scar import Scar
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, COLOUR_MAP, write_figures

# Number of µm³ in a mm³.
PER_CUBE = 1e9


def write_figure(scar: Scar, name: str, path: Path) -> None:
    """Draw the scar in the scan ``name``."""
    write_figures([(path.stem, partial(figure, scar, name))], path.parent)


def figure(scar: Scar, name: str) -> Figure:
    """Draw the map with the worn area, and the depth along x and along y."""
    error = "" if scar.volume_error is None else f" ± {PER_CUBE * scar.volume_error:.2g}"
    drawn = new_figure(f"{name}: {PER_CUBE * scar.volume:.4g}{error} µm³ worn", 6.0)
    left, right = drawn.subfigures(1, 2, squeeze=False, width_ratios=(1.2, 1.0))[0]
    x, y = (
        (np.arange(count) - 0.5 * (count - 1)) * pitch
        for count, pitch in zip(scar.depth.shape, scar.pitch, strict=True)
    )
    axis, depth = left.subplots(), TO_MICRONS * scar.depth
    axis.set_aspect("equal")
    shown = axis.pcolormesh(x, y, depth.T, cmap=COLOUR_MAP, rasterized=True)
    axis.contour(x, y, scar.worn.T.astype(float), levels=[0.5], colors=[BLACK])
    left.colorbar(shown, ax=axis, label="depth [µm]")
    axis.set(xlabel="x [mm]", ylabel="y [mm]")
    deepest = np.unravel_index(
        np.argmax(np.where(scar.worn, np.nan_to_num(scar.depth), -np.inf)), scar.depth.shape
    )
    _draw_lines(right, scar, (x, y), (int(deepest[0]), int(deepest[1])))
    return drawn


def _draw_lines(
    part: Figure, scar: Scar, at: tuple[Array, Array], deepest: tuple[int, int]
) -> None:
    axes = part.subplots(2, 1)
    lines = scar.depth[:, deepest[1]], scar.depth[deepest[0], :]
    inside = scar.worn[:, deepest[1]], scar.worn[deepest[0], :]
    for axis, along, depth, worn, name in zip(axes, at, lines, inside, "xy", strict=True):
        axis.plot(along, TO_MICRONS * depth, color="0.6", lw=1.0, label="rim")
        axis.plot(
            along, np.where(worn, TO_MICRONS * depth, np.nan), color=BLUE, lw=1.6, label="worn"
        )
        axis.set(xlabel=f"{name} [mm]", ylabel="depth [µm]")
        axis.invert_yaxis()
    legend_below(part, [axes[0]])
