"""Tables and figures of `docs/validation.md`: computed results beside measured ones.

    python docs/validate.py RUNS [NAME ...]

`make docs-figures` makes them too. Finished runs below RUNS are reused; the others are computed
first, which takes about 10 minutes of one core for all. With names of runs, only these are computed
and nothing is drawn. `validation_results.py` has the comparisons.
"""

from __future__ import annotations

import csv
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from draw_gallery import ROOT, store
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from validation_codes import LEVEL_SETS, MESHES, abaqus, codes, llavori_figure
from validation_results import (
    JOULE,
    RUNS,
    Comparison,
    Finished,
    areas,
    comparisons,
    measured_mccoll,
    measured_profiles,
    number,
)

from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, write_figures

FIGURES = ROOT / "docs" / "figures"
HEIGHT = 5.2

# --- table --------------------------------------------------------------------------------------

HEADINGS = (*("test", "quantity", "measured", "computed", "kind", "deviation", "likely cause"),)


def table(results: Mapping[Comparison, tuple[float, float | None]]) -> list[list[str]]:
    """Return the rows of the table, headings first."""
    rows = [list(HEADINGS)]
    for entry, (value, error) in results.items():
        measured, around = entry.measured
        deviation = 100.0 * (value / measured - 1.0)
        within = ""
        if around is not None:
            inside = abs(value - measured) <= around + (error or 0.0)
            within = " (within)" if inside else " (beyond)"
        rows.append(
            [
                entry.test,
                entry.quantity,
                number(measured, around),
                number(value, error),
                entry.kind,
                f"{deviation:+.2g} %".replace("-", "−") + within,
                entry.cause,
            ]
        )
    return rows


# --- figures ------------------------------------------------------------------------------------

COLOURS = {"calibrated": GREEN, "partly calibrated": BLUE, "predicted": ORANGE}
Results = Mapping[Comparison, tuple[float, float | None]]


def mccoll_figure(run: Finished) -> Figure:
    """Draw the worn profile beside the measured one, and the depth over the cycles."""
    places, depths = measured_profiles("mccoll_2004")
    cycles, x, computed = run.depths()
    centre = np.array([np.interp(0.0, x, depth) for depth in computed])
    short = 1.0 - areas(x, computed[-1]) / areas(places, depths)[0]
    figure = new_figure(
        f"McColl 2004: the depth is met, the worn area is {100 * short:.0f} % too small", HEIGHT
    )
    left, right = figure.subplots(1, 2)
    left.plot(places, -depths[0], color=BLACK, linewidth=1.0, label="measured")
    left.plot(x, -computed[-1], color=ORANGE, label="computed")
    left.set(
        xlabel="x [mm]", ylabel="surface of the flat [µm]", xlim=(places[0], places[-1]),
        title="After 18,000 cycles",
    )  # fmt: skip
    right.plot(cycles, centre, color=ORANGE, label="computed")
    reached, level, mesh, *_ = abaqus("mccoll_2004").T
    right.plot(reached, level, **LEVEL_SETS)
    right.plot(reached, mesh, **MESHES)
    (depth, around), *_ = measured_mccoll()
    right.errorbar(
        reached[-1],
        depth,
        around,
        fmt="s",
        mfc="none",
        color=BLACK,
        capsize=4,
        label="measured, ± deviation",
    )
    right.set(xlabel="cycles", ylabel="depth [µm]", title="In the middle of the flat")
    right.set(xlim=(0, None), ylim=(0, None))
    legend_below(figure, [left, right])
    return figure


def cruzado_figure(run: Finished) -> Figure:
    """Draw the worn profile beside those of three tests."""
    places, depths = measured_profiles("cruzado_2010")
    _, x, computed = run.depths()
    figure = new_figure("Cruzado 2010: the groove lies among those of three tests", HEIGHT)
    axis = figure.subplots()
    for depth, style, test in zip(depths, ("-", "--", ":"), (1, 2, 3), strict=True):
        axis.plot(places, -depth, style, color=BLACK, linewidth=1.0, label=f"measured, test {test}")
    axis.plot(x, -computed[-1], color=ORANGE, label="computed")
    axis.set(xlabel="x [mm]", ylabel="surface of the block [µm]", xlim=(x[0], x[-1]))
    axis.legend()
    return figure


def rig_figure(results: Results) -> Figure:
    """Draw worn volumes over energy, and stiffness and frequencies, measured and computed."""
    figure = new_figure(
        "Friction rig: stiffness of smooth bodies is too large, early wear too small", HEIGHT
    )
    panels = figure.subplots(1, 3)
    worn = [entry for entry in results if "worn volume" in entry.quantity]
    energies = [float(entry.quantity.split()[3]) for entry in worn]
    volume, stiffness, first = panels
    values = [results[entry][0] for entry in worn]
    volume.errorbar(
        energies, [entry.measured[0] for entry in worn], [entry.measured[1] for entry in worn],
        fmt="s", color=BLACK, capsize=4, label="measured",
    )  # fmt: skip
    order = np.argsort(energies)
    volume.plot(np.take(energies, order), np.take(values, order), "-o", color=ORANGE,
                label="computed")  # fmt: skip
    volume.set(xlabel="energy dissipated [J]", ylabel="worn volume [10⁻³ mm³]")
    volume.set(xlim=(0, None), ylim=(0, None))
    _pairs(stiffness, results, "contact stiffness", "stiffness [N/µm]")
    _pairs(first, results, "first mode", "frequency [Hz]")
    legend_below(figure, panels)
    return figure


def _pairs(axis: Axes, results: Results, what: str, label: str) -> None:
    """Draw computed values over measured ones, with the line on which they agree."""
    own = {entry: value for entry, value in results.items() if entry.quantity.startswith(what)}
    measured = [entry.measured[0] for entry in own]
    values = [value for value, _ in own.values()]
    errors = [error or 0.0 for _, error in own.values()]
    around = [entry.measured[1] or 0.0 for entry in own]
    axis.errorbar(measured, values, errors, around, fmt="o", color=ORANGE, capsize=4)
    most = 1.1 * max(*measured, *values)
    axis.plot([0.0, most], [0.0, most], color=PURPLE, linewidth=1.0, label="agreement")
    axis.set(xlabel=f"measured {label}", ylabel=f"computed {label}", xlim=(0, most), ylim=(0, most))


def bolted_figure(run: Finished, results: Results) -> Figure:
    """Draw the cycles of a bolted joint over its energy."""
    own = [e for e in results if e.test == "Li 2020, test 4" and e.measured[0] > 1.0]
    largest = max(abs(results[entry][0] / entry.measured[0] - 1.0) for entry in own)
    figure = new_figure(
        f"Li 2020, test 4: cycles to a dissipated energy are within {100 * largest:.1f} %", HEIGHT
    )
    axis = figure.subplots()
    states = run["states"]
    axis.plot(
        [1e-3 * state["energy"] / JOULE for state in states],
        [1e-3 * state["cycles"] for state in states],
        "-o", color=ORANGE, label="computed",
    )  # fmt: skip
    energies = [float(entry.quantity.split()[2]) for entry in own]
    axis.plot(energies, [e.measured[0] for e in own], "s", color=BLACK, label="measured")
    axis.set(xlabel="energy dissipated [kJ]", ylabel="thousands of cycles")
    axis.set(xlim=(0, None), ylim=(0, None))
    axis.legend()
    return figure


def overview_figure(results: Results) -> Figure:
    """Draw the deviations of all comparisons, with scatter and error of each."""
    figure = new_figure(
        "Smooth bodies are too stiff; the rig under 53 N and early wear are not met",
        1.2 + 0.34 * len(results),
    )
    axis = figure.subplots()
    for place, (entry, (value, error)) in enumerate(results.items()):
        measured, around = entry.measured
        spread = 100.0 * ((around or 0.0) + (error or 0.0)) / measured
        axis.errorbar(
            100.0 * (value / measured - 1.0), place, xerr=spread or None, fmt="o", capsize=3,
            color=COLOURS[entry.kind],
        )  # fmt: skip
    axis.set_yticks(
        range(len(results)), [f"{entry.test}: {entry.quantity.split(' [')[0]}" for entry in results]
    )
    for kind, colour in COLOURS.items():
        axis.plot([], [], "o", color=colour, label=kind)
    axis.axvline(0.0, color=BLACK, linewidth=1.0)
    axis.invert_yaxis()
    axis.set(xlabel="deviation [%], with scatter and error")
    axis.legend()
    return figure


# --- all ----------------------------------------------------------------------------------------


def finished(runs: Path, name: str) -> Finished:
    """Return a run, which is computed if it is not there."""
    run, folder = RUNS[name], runs / name
    if not (folder / "summary.json").exists():
        case = str(ROOT / "cases" / f"{run.case}.yaml")
        command = ["fretscale", "run", case, "--out", str(folder), "--force", "-q"]
        settings = [part for setting in run.settings for part in ("--set", setting)]
        subprocess.run([*command, *settings], check=True)
    return Finished(folder)


def compare(runs: Path, entries: Iterable[Comparison]) -> dict[Comparison, Any]:
    """Return the computed result and its error for each comparison."""
    done = {name: finished(runs, name) for name in RUNS}
    return {entry: entry.computed(done[entry.run]) for entry in entries}


def write(name: str, rows: Sequence[Sequence[str]]) -> None:
    """Write a table of the page."""
    with (FIGURES / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def main(runs: Path, names: list[str]) -> None:
    """Compute the runs named; or all, and store the tables and figures."""
    for name in names or RUNS:
        finished(runs, name)
    if names:
        return
    results = compare(runs, comparisons())
    done = partial(finished, runs)
    write("validation", table(results))
    write("validation_codes", codes(done))
    figures = [
        ("validation", partial(overview_figure, results)),
        ("validation_mccoll", partial(mccoll_figure, done("mccoll_2004"))),
        ("validation_cruzado", partial(cruzado_figure, done("cruzado_2010"))),
        ("validation_llavori", partial(llavori_figure, done("llavori_2026"))),
        ("validation_rig", partial(rig_figure, results)),
        ("validation_bolted", partial(bolted_figure, done("bolted_joint_test4"), results)),
    ]
    with TemporaryDirectory() as folder:
        for picture in write_figures(figures, Path(folder)):
            store(picture, FIGURES / picture.name)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
