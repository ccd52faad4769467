"""Tables and figures of `docs/validation.md`: computed results beside measured ones.

    python docs/validate.py RUNS [NAME ...]

`make docs-figures` makes them too. Finished runs below RUNS are reused; the others are computed
first, which takes about 10 minutes of one core for all. With names of runs, only these are computed
and nothing is drawn. Nothing is fitted here: inputs are those that the publications print.
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import floor, log10
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import h5py
import numpy as np
from draw_gallery import ROOT, store
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, write_figures

FIGURES = ROOT / "docs" / "figures"
DATA = ROOT / "cases" / "validation"
HEIGHT = 5.2
# Half width of the middle of a scar, over which depths are averaged, and distance from the middle
# beyond which a profile is a rim [mm].
MIDDLE = {"mccoll_2004": 0.05, "cruzado_2010": 0.2}
RIM = {"mccoll_2004": 0.3, "cruzado_2010": 1.5}
# Cycles at which depths are held against those of Abaqus.
CYCLES = (1000, 5000, 10000, 18000)
MICROMETRE, PER_MICROMETRE, JOULE = 1e-3, 1e3, 1e3  # in mm, N/mm per N/µm, N mm


@dataclass(frozen=True)
class Run:
    """Run of a shipped case, with overrides of its entries."""

    case: str
    settings: tuple[str, ...] = ()


RUNS: Mapping[str, Run] = {
    "mccoll_2004": Run("validation/mccoll_2004"),
    "cruzado_2010": Run("validation/cruzado_2010"),
    "rig_bouc_wen": Run("rig_bouc_wen"),
    "rig_force_75N": Run("rig_force_75N"),
    "rig_force_53N": Run("rig_force_75N", ("excitation.force=53 N", "energies=[2800 J]")),
    "rig_hammer_7N": Run("rig_hammer_7N"),
    "rig_hammer_60N": Run("rig_hammer_60N"),
    "rig_two_dof": Run("rig_two_dof", ("forces=[1 N]", "frequencies=[200 Hz, 230 Hz]")),
    "specimens_wear": Run("specimens_wear"),
    "specimens_curved": Run("specimens_curved", ("output.paraview=false",)),
    "rig_computed_wear": Run("rig_computed_wear"),
    "bolted_joint_test2": Run("bolted_joint_test2"),
    "bolted_joint_test4": Run("bolted_joint_test4"),
}


@dataclass(frozen=True)
class Finished:
    """Finished run in a folder."""

    folder: Path

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Summary of the run."""
        found: dict[str, Any] = json.loads((self.folder / "summary.json").read_text("utf-8"))
        return found

    def __getitem__(self, path: str) -> Any:
        """Return a value of the summary by its path."""
        value: Any = self.summary
        for key in path.split("."):
            value = value[int(key)] if isinstance(value, list) else value[key]
        return value

    def depths(self) -> tuple[Array, Array, Array]:
        """Return cycles ``(n,)``, places ``(m,)`` [mm] and depths of body 1 ``(n, m)`` [µm]."""
        with h5py.File(self.folder / "results.h5") as file:
            surfaces = file["surfaces/interface"]
            heights = np.array([surfaces[name]["body_1"][:, 0] for name in sorted(surfaces)])
            first = surfaces[min(surfaces)]["body_1"]
            places = np.asarray(first.dims[0][0])
        return (
            np.array(self["kinetics.cycles"]),
            places,
            (heights[0] - heights) / MICROMETRE,
        )


Computed = Callable[[Finished], tuple[float, float | None]]
"""Function that returns a result of a run and its estimated error, None if that is unknown."""


@dataclass(frozen=True)
class Comparison:
    """Result of a run beside a measured one.

    ``measured`` is a value and its scatter, None if that is not printed; both in the unit of
    ``quantity``.
    """

    test: str
    quantity: str
    measured: tuple[float, float | None]
    run: str
    computed: Computed
    kind: Literal["calibrated", "partly calibrated", "predicted"]
    cause: str


# --- measured profiles --------------------------------------------------------------------------


def measured_profiles(name: str) -> tuple[Array, Array]:
    """Return places ``(m,)`` [mm] and depths of each test ``(k, m)`` [µm] below its rims."""
    table = np.genfromtxt(
        DATA / f"{name}_profile{'s' * (name == 'cruzado_2010')}.csv",
        delimiter=",",
        comments="#",
        skip_header=5,
    )
    places, rim = table[:, 0], RIM[name]
    depths = []
    for height in table[:, 1:].T:
        ends = [height[places < -rim].mean(), height[places > rim].mean()]
        depths.append(np.interp(places, [places[0], places[-1]], ends) - height)
    return places, np.array(depths)


def middle(name: str, places: Array, depth: Array) -> Array:
    """Return the depths in the middle of a scar."""
    return depth[..., np.abs(places) <= MIDDLE[name]]


def half_width(places: Array, depth: Array, level: float) -> float:
    """Return the width over which a scar is deeper than ``level``."""
    deeper = places[depth > level]
    return float(deeper.max() - deeper.min())


def areas(places: Array, depths: Array) -> Array:
    """Return the areas of profiles [1e-3 mm²]."""
    return np.trapezoid(depths, places, axis=-1)


def scatter(values: Array) -> tuple[float, float]:
    """Return the mean of tests and their standard deviation."""
    return float(values.mean()), float(values.std(ddof=1))


def measured_mccoll() -> tuple[tuple[float, float], tuple[float, None], tuple[float, None]]:
    """Return depth in the middle [µm], width at half of it [mm] and area [1e-3 mm²]."""
    places, depths = measured_profiles("mccoll_2004")
    inner = middle("mccoll_2004", places, depths[0])
    depth = float(inner.mean()), float(inner.std())
    width = half_width(places, depths[0], 0.5 * depth[0])
    return depth, (width, None), (float(areas(places, depths)[0]), None)


def measured_cruzado() -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    """Return the same of three tests, with their standard deviations."""
    places, depths = measured_profiles("cruzado_2010")
    inner = middle("cruzado_2010", places, depths).mean(axis=1)
    pairs = zip(depths, inner, strict=True)
    widths = np.array([half_width(places, depth, 0.5 * level) for depth, level in pairs])
    return scatter(inner), scatter(widths), scatter(areas(places, depths))


# --- computed results ---------------------------------------------------------------------------


def at(path: str, unit: float = 1.0, error: str | float | None = None) -> Computed:
    """Return a result by its path; ``error`` is the path of a relative error, or that error."""

    def computed(run: Finished) -> tuple[float, float | None]:
        value = float(run[path]) / unit
        relative = run[error] if isinstance(error, str) else error
        return value, None if relative is None else abs(value) * float(relative)

    return computed


def loop(state: str, name: str, unit: float = 1.0) -> Computed:
    """Return a result of a computed loop of the contact with its own estimate of error."""

    def computed(run: Finished) -> tuple[float, float]:
        found = run[f"interface.loops.{state}"]
        return found[name] / unit, found[f"{name}_error"] / unit

    return computed


def frequency(path: str, name: str) -> Computed:
    """Return a frequency of a spectrum, known to half its resolution and to the time steps."""

    def computed(run: Finished) -> tuple[float, float]:
        state = run[path]
        value = float(state[name])
        return value, max(0.5 * state["resolution"], value * state["step_error"])

    return computed


def scar_depth(name: str) -> Computed:
    """Return the depth in the middle of a scar."""

    def computed(run: Finished) -> tuple[float, float]:
        _, places, depths = run.depths()
        value = float(middle(name, places, depths[-1]).mean())
        return value, value * run["interface.error.depth.total"]

    return computed


def scar_width(name: str) -> Computed:
    """Return the width of a scar at half its depth, known to a cell at either end."""

    def computed(run: Finished) -> tuple[float, float]:
        _, places, depths = run.depths()
        level = 0.5 * float(middle(name, places, depths[-1]).mean())
        return half_width(places, depths[-1], level), float(places[1] - places[0])

    return computed


def worn_volume(energy: float) -> Computed:
    """Return the volume worn from both bodies by some energy [J], in 1e-3 mm³."""

    def computed(run: Finished) -> tuple[float, float]:
        worn = run["interface.volume_1"] + run["interface.volume_2"]
        value = 1e3 * energy * JOULE * worn / run["interface.energy"]
        return value, value * run["interface.error.volume.total"]

    return computed


def share(path: str, of: str) -> Computed:
    """Return a ratio of two results in closed form."""
    return lambda run: (float(run[path]) / float(run[of]), 0.0)


# --- comparisons --------------------------------------------------------------------------------

SMALL = 0.99e-3  # error of joints alone: their cases hold them against closed forms to 0.1 %
STEADY = "the function is a fit to this test"
ROUGH = "no roughness in the model: smooth bodies touch more stiffly"
FIT_ENERGY = "the loop of the fitted law is rounder than a measured one, and the stroke is a mean"
SLOPE = "α is the slope of tests 3 to 5; their line misses the origin, as early wear is faster"


def comparisons() -> list[Comparison]:
    """Return all comparisons, in the order of the table."""
    return [*scars(), *contact_parameters(), *responses(), *volumes(), *bolted_joints()]


def scars() -> list[Comparison]:
    """Return the comparisons of scars."""
    depth, width, area = measured_mccoll()
    test, name = "McColl 2004", "mccoll_2004"
    found = [
        Comparison(
            test, "depth in the middle of the flat [µm]", depth, name, scar_depth(name),
            "partly calibrated",
            "k was fitted to worn volumes; debris and roughness (0.2 µm) are not modelled",
        ),
        Comparison(
            test, "width of the scar at half depth [mm]", width, name, scar_width(name),
            "partly calibrated", "as the area",
        ),
        Comparison(
            test, "worn area of the flat [1e-3 mm²]", area, name,
            at("interface.volume_1", 1e-3, "interface.error.volume.total"), "calibrated",
            "k is that of the whole scar, this is one profile; where its rims lie is uncertain",
        ),
    ]  # fmt: skip
    depth, width, area = measured_cruzado()
    test, name = "Cruzado 2010", "cruzado_2010"
    return [
        *found,
        Comparison(
            test, "depth in the middle of the block [µm]", depth, name, scar_depth(name),
            "partly calibrated", "form of the ring, given the volume",
        ),
        Comparison(
            test, "width of the groove at half depth [mm]", width, name, scar_width(name),
            "partly calibrated", "form of the ring, given the volume; rough grooves",
        ),
        Comparison(
            test, "worn area of the block [1e-3 mm²]", area, name,
            at("interface.volume_1", 1e-3, "interface.error.volume.total"), "calibrated",
            "k counts as fitted to these tests",
        ),
    ]  # fmt: skip


def contact_parameters() -> list[Comparison]:
    """Return the comparisons of friction, stiffness and loops of the friction rig."""
    law, test = "rig_bouc_wen", "Fantetti 2019, test 1"
    worn, elastic = "states.-1", "specimens_wear"
    return [
        Comparison(
            test, "friction coefficient, steady [1]", (0.91, 0.02), law,
            at(f"{worn}.extracted.friction", 1.0, SMALL), "calibrated",
            "the printed logarithm goes on rising beyond the measured range",
        ),
        Comparison(
            test, "contact stiffness, steady [N/µm]", (62.5, 4.5), law,
            at(f"{worn}.extracted.stiffness", PER_MICROMETRE, SMALL), "calibrated", STEADY,
        ),
        Comparison(
            test, "energy of a loop, steady [mJ]", (1.5, 0.2), law,
            at(f"{worn}.energy_per_cycle", 1.0, SMALL), "predicted", FIT_ENERGY,
        ),
        Comparison(
            test, "cycles to 2800 J [1e6]", (1.9, None), law, at("cycles", 1e6, SMALL),
            "predicted", "follows from the energy of the loops",
        ),
        Comparison(
            "Fantetti 2019, tests 3-5", "stroke under 75 N [µm]", (22.0, None), "rig_force_75N",
            at(f"{worn}.stroke", MICROMETRE, f"{worn}.step_error"), "predicted",
            "the functions are fits to test 1; the paper prints 73 N as well",
        ),
        Comparison(
            "Fantetti 2019, tests 3-5", "energy of a loop under 75 N [mJ]", (2.2, 0.2),
            "rig_force_75N", at(f"{worn}.energy_per_cycle", 1.0, f"{worn}.step_error"),
            "predicted", "the functions are fits to test 1; the paper prints 73 N as well",
        ),
        Comparison(
            "Fantetti 2019, tests 1-2", "stroke under 53 N [µm]", (14.0, None), "rig_force_53N",
            at(f"{worn}.stroke", MICROMETRE, f"{worn}.step_error"), "predicted",
            "sliding needs 4µN/π = 69 N at the printed µ, so that the joint sticks: the force on "
            "the rig is not the printed one, or its two masses leave something out",
        ),
        Comparison(
            "Fantetti 2019, tests 4-5", "contact stiffness, unworn [N/µm]", (26.0, None), elastic,
            loop("unworn", "kt", PER_MICROMETRE), "predicted", ROUGH,
        ),
        Comparison(
            "thesis, 17 to 250 N", "contact stiffness, worn [N/µm]", (50.0, None),
            "specimens_curved", at("loads.0.worn.stick_stiffness", PER_MICROMETRE), "predicted",
            "no roughness in the model; the thesis finds twice the measured stiffness too",
        ),
        Comparison(
            test, "energy of a loop at 630 J, elastic bodies [mJ]", (1.5, 0.2), elastic,
            loop("worn", "energy_per_loop"), "predicted",
            "µ is the fit to this test, stiffness that of smooth bodies",
        ),
    ]  # fmt: skip


def responses() -> list[Comparison]:
    """Return the comparisons of frequencies of the friction rig."""
    test = "Fantetti 2019, hammer"
    return [
        Comparison(
            test, "first mode under 60 N, unworn [Hz]", (180.0, None), "rig_hammer_60N",
            frequency("states.0", "first_frequency"), "predicted",
            "held at most by the printed kt: 173 Hz",
        ),
        Comparison(
            test, "first mode under 60 N, unworn, kt of elastic bodies [Hz]", (180.0, None),
            "rig_computed_wear", frequency("states.0", "first_frequency"), "predicted", ROUGH,
        ),
        Comparison(
            test, "first mode under 7 N, unworn [Hz]", (40.0, None), "rig_hammer_7N",
            frequency("states.0", "first_frequency"), "predicted",
            "a sliding joint still has the printed kp, fitted under 60 N: 50.8 Hz; without it 39.8",
        ),
        Comparison(
            test, "first mode under 7 N, worn (as 60 N, unworn) [Hz]", (180.0, None),
            "rig_hammer_7N", frequency("states.-1", "first_frequency"), "predicted",
            "kt has risen 2.25 times, µN is the same",
        ),
        Comparison(
            test, "second mode under 60 N, unworn [Hz]", (2550.0, 50.0), "rig_hammer_60N",
            frequency("states.0", "second_frequency"), "predicted",
            "masses and springs were fitted to hammer tests of the free rig",
        ),
        Comparison(
            test, "second mode under 60 N, worn [Hz]", (2550.0, 50.0), "rig_hammer_60N",
            frequency("states.-1", "second_frequency"), "predicted",
            "the arm is taken to be rigid, so that all of kt acts on its mass",
        ),
        Comparison(
            "thesis, rig", "first mode, light load [Hz]", (40.0, None), "rig_two_dof",
            at("free.0", 1.0, 0.0), "predicted", "eigenvalue of the rig alone",
        ),
        Comparison(
            "thesis, rig", "first mode, high load [Hz]", (200.0, None), "rig_two_dof",
            at("stuck.0", 1.0, 0.0), "predicted",
            "eigenvalue with the joint stuck at 45 N/µm; the thesis computes 400 Hz",
        ),
    ]  # fmt: skip


def volumes() -> list[Comparison]:
    """Return the comparisons of worn volume over energy."""
    tests = {1: (2800, 4.6), 2: (2900, 5.2), 3: (500, 3.2), 4: (2900, 7.3), 5: (7100, 12.7)}
    return [
        Comparison(
            f"Fantetti 2019, test {test}", f"worn volume after {energy} J [1e-3 mm³]",
            (volume, 0.2 * volume), "specimens_wear", worn_volume(energy),
            "calibrated" if test > 2 else "predicted",
            SLOPE if test > 2 else "α of strokes of 22 µm, here 14 µm",
        )
        for test, (energy, volume) in tests.items()
    ]  # fmt: skip


def bolted_joints() -> list[Comparison]:
    """Return the comparisons of bolted joints."""
    test, points = "Li 2020, test 4", {
        1: ("1 J", 0.1), 2: ("2 kJ", 245), 3: ("4 kJ", 485), 4: ("6 kJ", 725)
    }  # fmt: skip

    stroke = "the stroke is the mean of a test in which it scattered; loops are those of the fits"
    return [
        *(
            Comparison(
                test, f"cycles to {energy} [1e3]", (cycles, None),
                "bolted_joint_test4", at(f"states.{state}.cycles", 1e3, SMALL), "predicted",
                stroke if state > 1 else "the paper says 100 cycles and about 1 J",
            )
            for state, (energy, cycles) in points.items()
        ),
        Comparison(
            "Li 2020, test 2", "energy of a loop, final over initial [1]", (0.84, None),
            "bolted_joint_test2", share("states.-1.energy_per_cycle", "states.0.energy_per_cycle"),
            "predicted",
            "the stroke is held, that of the test changed; no residual stiffness is printed",
        ),
    ]  # fmt: skip


# --- table --------------------------------------------------------------------------------------

HEADINGS = (*("test", "quantity", "measured", "computed", "kind", "deviation", "likely cause"),)
# Digits of values without an error, and relative error below which an error is not shown.
DIGITS, LEAST = 3, 1e-3


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


def number(value: float, around: float | None) -> str:
    """Return a value with its scatter or its error, which has two digits."""
    if around is None or around < LEAST * abs(value):
        shown = f"{value:.{DIGITS}g}" if abs(value) < 10**DIGITS else f"{value:.0f}"
        if around is None:
            return shown
        return f"{shown} (closed form)" if around == 0.0 else f"{shown} (error below 0.1 %)"
    decimals = max(0, 1 - floor(log10(around)))
    return f"{value:.{decimals}f} ± {around:.{decimals}f}"


def codes(run: Finished) -> list[list[str]]:
    """Return the table of depths in the middle of the flat beside those of Abaqus."""
    cycles, places, depths = run.depths()
    centre = [float(np.interp(0.0, places, depth)) for depth in depths]
    rows = [["cycles", "computed [µm]", "level sets [µm]", "moving mesh [µm]"]]
    for reached, level, mesh in abaqus():
        value = float(np.interp(reached, cycles, centre))
        rows.append([f"{reached:.0f}", number(value, value * run["interface.error.depth.total"])])
        rows[-1] += [f"{level:.2f}", f"{mesh:.2f}"]
    return rows


def abaqus() -> Array:
    """Return cycles and depths by level sets and on a moving mesh ``(n, 3)`` [µm]."""
    return np.genfromtxt(
        DATA / "mccoll_2004_abaqus.csv", delimiter=",", comments="#", skip_header=5
    )


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
    reached, level, mesh = abaqus().T
    right.plot(reached, level, "o", color=BLUE, mfc="none", ms=11, label="Abaqus, level sets")
    right.plot(reached, mesh, "x", color=PURPLE, ms=9, label="Abaqus, moving mesh")
    (depth, around), *_ = measured_mccoll()
    right.errorbar(
        CYCLES[-1],
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
    write("validation_codes", codes(done("mccoll_2004")))
    figures = [
        ("validation", partial(overview_figure, results)),
        ("validation_mccoll", partial(mccoll_figure, done("mccoll_2004"))),
        ("validation_cruzado", partial(cruzado_figure, done("cruzado_2010"))),
        ("validation_rig", partial(rig_figure, results)),
        ("validation_bolted", partial(bolted_figure, done("bolted_joint_test4"), results)),
    ]
    with TemporaryDirectory() as folder:
        for picture in write_figures(figures, Path(folder)):
            store(picture, FIGURES / picture.name)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
