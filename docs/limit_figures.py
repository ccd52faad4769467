"""Figures of `docs/limits.md`: results on both sides of the limits of each method.

    python docs/limit_figures.py [FIGURE ...]

`make docs-figures` draws them too. Every point is a run of a model in Python, and each figure takes
less than a minute. The numbers that the page quotes are printed, each with the codes of the
warnings and errors of its run. Marks with an orange ring are runs that warn.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fretscale
import numpy as np
from draw_gallery import ROOT, store
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fe_models.dynamics import HarmonicForce, Link, TimeStepControl, lumped_rig
from fe_models.dynamics.periodic.harmonics import Resolution
from sa_solver import Material
from sa_solver.reference.waviness import WavySurface
from sa_solver.types import Array
from wear import EnergyLaw
from wear.joints import ElasticStop, Jenkins
from workflow.errors import FretscaleError
from workflow.messages.error_kinds import error_kind
from workflow.messages.warning_kinds import WarningKind
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, write_figures

HEIGHT = 4.6
NO_RESONANCE = WarningKind.NO_RESONANCE.code
TITANIUM, LAW = Material(115e3, 0.29), EnergyLaw(1e-8)
MODULUS = 0.5 * TITANIUM.young / (1.0 - TITANIUM.poisson**2)
RADIUS, LOAD = 10.0, 50.0
ONE_CYCLE = fretscale.Wear(cycles=1.0, jump=fretscale.JumpSize(cycles=1.0))


# --- runs ---------------------------------------------------------------------------------------


def _run(model: Any, name: str, measured: Callable[[Any], dict[str, float]]) -> dict[str, Any]:
    """Run a model; return and print what is measured, with the codes of the messages."""
    found: dict[str, Any] = {"codes": ()}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", fretscale.ModelWarning)
        try:
            found |= measured(model.run())
        except FretscaleError as error:
            found["codes"] = (error_kind(error).code,)
    given = [each.message for each in caught]
    told = [each.code for each in given if isinstance(each, fretscale.ModelWarning)]
    found["codes"] = (*found["codes"], *dict.fromkeys(told))
    numbers = ", ".join(f"{key} {value:.5g}" for key, value in found.items() if np.ndim(value) == 0)
    print(f"{name}: {numbers} {' '.join(found['codes'])}")  # noqa: T201
    return found


def _bodies(line: bool, size: float, loads: fretscale.LoadTable) -> fretscale.BodyPair:
    """Return a ball or a cylinder of 10 mm on a flat."""

    def gap(x: Array, y: Array) -> Array:
        return (x**2 + (0.0 if line else y**2)) / (2.0 * RADIUS)

    return fretscale.BodyPair(gap, (size, size), loads, line=line)


def _contact(
    cells: int, line: bool, friction: float = 0.6, full: bool = False
) -> fretscale.Contact:
    """Return a contact of titanium on a grid of so many cells along each side."""
    grid, method = (cells, 1 if line else cells), "full" if full else "normal"
    return fretscale.Contact(
        grid, (TITANIUM, TITANIUM), (LAW, LAW), friction=friction, method=method
    )


def _last(results: Any, name: str) -> float:
    return float(results["interface"][name][-1])


def _plot(
    axis: Axes, x: Sequence[float], runs: Sequence[Mapping[str, Any]], y: str, **style: Any
) -> None:
    """Plot a result of runs; those that warn have a ring, those that fail are left out."""
    points = [(at, run[y], run["codes"]) for at, run in zip(x, runs, strict=True) if y in run]
    axis.plot([point[0] for point in points], [point[1] for point in points], marker="o", **style)
    # A curve that ends on its way to the resonance says nothing of the method.
    warned = [point[:2] for point in points if set(point[2]) - {NO_RESONANCE}]
    if warned:
        axis.plot(*zip(*warned, strict=True), "o", mfc="none", mec=ORANGE, ms=12, mew=2.0)


# --- figures ------------------------------------------------------------------------------------


def explicit() -> Figure:
    """Draw pressures worn by explicit steps below and above their stability limit."""
    loads = fretscale.LoadTable.stroke(P=LOAD, stroke=0.02)
    steps: dict[str, dict[str, Any]] = {"implicit": {}}
    for fraction in (0.9, 1.1, 1.5):
        steps[f"explicit, {fraction:g} of the limit"] = {"steps": "explicit", "fraction": fraction}

    def measured(results: Any) -> dict[str, Any]:
        pressure = results["interface"]["pressure"].isel(cycles=-1).squeeze()
        return {
            "peak": float(pressure.max()),
            "depth": 1e3 * _last(results, "largest_depth_1"),
            "volume": _last(results, "volume_1"),
            "x": pressure["x"].values,
            "pressure": pressure.values,
        }

    figure = new_figure("Pressure after 20,000 cycles of a sliding cylinder", HEIGHT)
    axis = figure.subplots()
    colours = (BLACK, BLUE, ORANGE, PURPLE)
    for (name, given), colour in zip(steps.items(), colours, strict=True):
        wear = fretscale.Wear(cycles=2e4, motion="neglect", **given)
        model = fretscale.WearModel(_bodies(True, 0.6, loads), _contact(96, True), wear)
        run = _run(model, name, measured)
        label = f"{name}{': warns' if run['codes'] else ''}"
        axis.plot(run["x"], run["pressure"], color=colour, label=label, lw=1.4)
    axis.set(xlabel="x [mm]", ylabel="pressure [MPa]", ylim=(0.0, None))
    legend_below(figure, [axis], columns=2)
    return figure


def grid() -> Figure:
    """Draw the error of the largest pressure against the cells across a ball and a cylinder."""
    figure = new_figure("Largest pressure against Hertz, on coarse grids", HEIGHT)
    axis = figure.subplots()
    loads = fretscale.LoadTable.stroke(P=LOAD, stroke=0.02)
    for line, name, colour in ((False, "ball", BLUE), (True, "cylinder", GREEN)):
        if line:
            half = np.sqrt(4.0 * LOAD * RADIUS / (np.pi * MODULUS))
            exact = 2.0 * LOAD / (np.pi * half)
        else:
            half = (0.75 * LOAD * RADIUS / MODULUS) ** (1.0 / 3.0)
            exact = 1.5 * LOAD / (np.pi * half**2)
        size, counts = 4.0 * half, (2, 4, 6, 8, 12, 16, 20, 24, 32, 48, 64)

        def measured(results: Any, exact: float = exact) -> dict[str, float]:
            pressure = results["interface"]["pressure"].isel(cycles=0)
            return {"error": 100.0 * abs(float(pressure.max()) / exact - 1.0)}

        runs = []
        for cells in counts:
            model = fretscale.WearModel(
                _bodies(line, size, loads), _contact(cells, line), ONE_CYCLE
            )
            runs.append(_run(model, f"{name}, {cells / 2:g} cells across", measured))
        across = [cells / 2 for cells in counts]
        _plot(axis, across, runs, "error", label=name, color=colour)
    across = np.array([3.0, 32.0])
    axis.plot(across, 100.0 / across**2, "--", color=GREY, label="1/k²")
    axis.set(xscale="log", yscale="log", xlabel="cells k across the contact")
    axis.set(ylabel="error of the largest pressure [%]")
    _whole_ticks(axis, (2, 4, 8, 16, 32))
    legend_below(figure, [axis], columns=3)
    return figure


def increments() -> Figure:
    """Draw the worn volume of a cycle of forces against its increments."""
    figure = new_figure("Wear of a cylinder under 40 to 80 N/mm with 0 to 20 N/mm of shear", HEIGHT)
    axis = figure.subplots()
    counts, runs = (1, 2, 4, 8, 16, 32), []
    for count in counts:
        legs = {"P": (80.0, 40.0), "Qx": (20.0, 0.0)}
        loads = fretscale.LoadTable.legs(legs, increments=(count, count))
        contact = _contact(48, True, friction=0.4, full=True)
        model = fretscale.WearModel(_bodies(True, 0.4, loads), contact, ONE_CYCLE)
        measured = partial(_volume, of=1.0)
        runs.append(_run(model, f"{count} increments a leg", measured))
    *runs, finest = runs
    for run in runs:
        run["error"] = 100.0 * (run["volume"] / finest["volume"] - 1.0)
    print("errors [%]:", [f"{run['error']:.3g}" for run in runs])  # noqa: T201
    _plot(axis, counts[:-1], runs, "error", color=BLUE)
    axis.set(xscale="log", yscale="log", xlabel="increments of each leg")
    axis.set(ylabel="error of the worn volume [%]")
    _whole_ticks(axis, counts[:-1])
    return figure


def _volume(results: Any, of: float) -> dict[str, float]:
    return {"volume": _last(results, "volume_1") / of}


def harmonics() -> Figure:
    """Draw the errors of the resonance of two masses on a slider against the highest harmonic."""
    springs = {Link("m1"): 1346.9, Link("m2", "m1"): 273e3}
    masses = {"m1": 21.152e-3, "m2": 1.189e-3}
    row = lumped_rig(masses, springs, joints=[[Link("m2")]], damping_ratio=0.001)
    rig = fretscale.RigModel.of(row, driven={"m1": 1.0}, observed=["m1"])
    slider = Jenkins(stiffness=45e3, friction=0.88, normal_load=60.0)

    def measured(results: Any) -> dict[str, float]:
        found = results["50 N"].attrs
        return {key: float(found[key]) for key in ("resonance", "amplitude", "damping", "error")}

    highest, runs = (1, 3, 5, 7, 15, 31, 63), []
    for last in highest:
        model = fretscale.VibrationModel(
            rig,
            slider,
            (50.0,),
            fretscale.FrequencySweep(20.0, 400.0),
            Resolution(tuple(range(1, last + 1, 2)), 512),
        )
        runs.append(_run(model, f"harmonics up to {last}", measured))
    figure = new_figure("Resonance of two masses on a slider under 50 N", HEIGHT)
    axis = figure.subplots()
    *runs, finest = runs
    names = {"amplitude": BLUE, "resonance": GREEN, "damping": PURPLE}
    for name, colour in names.items():
        for run in runs:
            run[f"{name}_error"] = 100.0 * abs(run[name] / finest[name] - 1.0)
        _plot(axis, highest[:-1], runs, f"{name}_error", label=name, color=colour)
    estimates = [100.0 * run["error"] for run in runs]
    axis.plot(highest[:-1], estimates, "--", color=GREY, label="estimate of the run")
    axis.set(xscale="log", yscale="log", xlabel="highest odd harmonic", ylabel="error [%]")
    _whole_ticks(axis, highest[:-1])
    legend_below(figure, [axis], columns=4)
    return figure


MASS, SPRING, GAP, FREQUENCY = 1e-3, 1e3, 0.01, 150.0


def stops() -> Figure:
    """Draw errors of a mass on a stop: in harmonics, and in time steps."""
    mass = lumped_rig({"m": MASS}, {Link("m"): SPRING}, [[Link("m")]], damping_ratio=0.01)
    rig = fretscale.RigModel.of(mass, driven={"m": 1.0}, observed=["m"])
    figure = new_figure("A mass that meets a stop at 150 Hz", HEIGHT)
    left, right = figure.subplots(1, 2)
    for ratio, colour in ((10.0, BLUE), (100.0, GREEN), (1000.0, PURPLE)):
        stop = ElasticStop(stiffness=ratio * SPRING, gap=GAP)
        resting = np.sqrt((1.0 + ratio) * SPRING / MASS) / (2.0 * np.pi)
        name = f"stop {ratio:g} times as stiff"
        counts = (3, 5, 10, 20, 40, 80, 120)
        runs = [_balanced(rig, stop, last, f"{name}, {last} harmonics") for last in counts]
        *shown, _ = _against_last(runs)
        share = [count * FREQUENCY / resting for count in counts[: len(shown)]]
        _plot(left, share, shown, "wrong", label=name, color=colour)
        steps = (8, 12, 20, 40, 80, 320)
        runs = [_in_time(rig, stop, 1.0 / (n * resting), f"{name}, {n} steps") for n in steps]
        *shown, _ = _against_last(runs)
        _plot(right, steps[: len(shown)], shown, "wrong", label=name, color=colour)
    left.set(xlabel="highest harmonic / frequency on the stop", ylabel="error [%]")
    right.set(xlabel="time steps in a period on the stop")
    for axis in (left, right):
        axis.set(xscale="log", yscale="log")
    left.set_ylim(1e-3, None)
    _whole_ticks(right, (8, 12, 20, 40, 80))
    legend_below(figure, [left, right], columns=3)
    return figure


def _balanced(rig: Any, stop: ElasticStop, last: int, name: str) -> dict[str, Any]:
    """Return the end of the curve up to 150 Hz by harmonic balance."""
    model = fretscale.VibrationModel(
        rig,
        stop,
        (5.0,),
        fretscale.FrequencySweep(60.0, FREQUENCY),
        Resolution(tuple(range(last + 1)), 1024),
    )

    def measured(results: Any) -> dict[str, float]:
        return {"value": float(results["5 N"]["amplitude"].values.ravel()[-1])}

    return _run(model, name, measured)


def _in_time(rig: Any, stop: ElasticStop, step: float, name: str) -> dict[str, Any]:
    """Return the largest displacement and the error estimate of the first 20 ms."""
    force = HarmonicForce(rig.driven, amplitude=20.0, frequency=FREQUENCY)
    model = fretscale.MotionModel(rig, stop, force, 0.02, TimeStepControl(step))

    def measured(results: Any) -> dict[str, float]:
        time, moved = results["time"].values, results["displacement"].values[:, -1]
        return {"value": float(np.interp(0.019, time, moved)), "estimate": results.step_error}

    return _run(model, name, measured)


def _against_last(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return runs with their error relative to the last one [%]."""
    for run in runs:
        if "value" in run:
            run["wrong"] = 100.0 * abs(run["value"] / runs[-1]["value"] - 1.0)
    print([f"{run.get('wrong', np.nan):.2g} %" for run in runs])  # noqa: T201
    return runs


def full_slip() -> Figure:
    """Draw the wear of a cycle of tangential force against its distance from full slip."""
    figure = new_figure("Wear of a cycle of ± Q, close to full slip", HEIGHT)
    axis = figure.subplots()
    lacking = np.array([0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001])
    for line, count, name, colour in (
        (True, 1, "cylinder", GREEN),
        (False, 1, "ball, 1 increment a leg", BLUE),
        (False, 3, "ball, 3 increments a leg", PURPLE),
    ):
        runs = []
        for less in (*lacking, -1e-4):
            force = (1.0 - less) * 0.6 * LOAD
            legs = {"P": (LOAD, LOAD), "Qx": (force, -force)}
            loads = fretscale.LoadTable.legs(legs, increments=(count, count))
            bodies = _bodies(line, 0.3 if line else 0.5, loads)
            contact = _contact(48 if line else 20, line, full=True)
            model = fretscale.WearModel(bodies, contact, ONE_CYCLE)
            measured = partial(_volume, of=LAW.coefficient * 0.6 * LOAD * 1e-3)
            runs.append(_run(model, f"{name}, Q = {1 - less:g} µP", measured))
        _plot(axis, lacking, runs[:-1], "volume", label=name, color=colour)
    axis.set(xscale="log", xlabel="1 − Q/µP", ylabel="mean slip of a cycle at µP [µm]")
    axis.invert_xaxis()
    axis.set_ylim(0.0, None)
    legend_below(figure, [axis], columns=3)
    return figure


def full_contact() -> Figure:
    """Draw the share of a wave that touches against the mean pressure, on three grids."""
    radius, length, height = 100.0, 0.05, 1e-4
    full = np.pi * MODULUS * height / length

    def gap(x: Array, y: Array) -> Array:
        return x**2 / (2.0 * radius) + height * (1.0 - np.cos(2.0 * np.pi * x / length))

    def measured(results: Any) -> dict[str, float]:
        pressure = results["interface"]["pressure"].isel(cycles=0).squeeze()
        wave = pressure.values[np.abs(pressure["x"].values) < 0.5 * length]
        low = float(wave.min()) / full
        return {"touching": float((wave > 0.0).mean()), "lowest": low, "peak": wave.max() / full}

    figure = new_figure("Middle wave of a wavy cylinder, pressed until its valleys close", HEIGHT)
    axis = figure.subplots()
    shares = np.array([0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99])
    for cells, colour in ((8, PURPLE), (16, GREEN), (64, BLUE)):
        runs = []
        for share in shares:
            force = (share * full) ** 2 * np.pi * radius / MODULUS
            loads = fretscale.LoadTable.stroke(P=float(force), stroke=1e-3)
            bodies = fretscale.BodyPair(gap, (3.2, 1.0), loads, line=True)
            model = fretscale.WearModel(bodies, _contact(64 * cells, True), ONE_CYCLE)
            runs.append(_run(model, f"{cells} cells a wave, {share:g} p*", measured))
        _plot(axis, shares, runs, "touching", label=f"{cells} cells in a wave", color=colour)
    fine = np.linspace(0.5, 0.9999, 200)
    exact = [WavySurface(height, length, share * full, MODULUS) for share in fine]
    touching = [2.0 * wave.half_width / length for wave in exact]
    axis.plot(fine, touching, color=BLACK, label="Westergaard")
    axis.set(xlabel="mean pressure / p*", ylabel="share of the wave in contact")
    legend_below(figure, [axis], columns=4)
    return figure


# --- all ----------------------------------------------------------------------------------------

FIGURES: Mapping[str, Callable[[], Figure]] = {
    "explicit": explicit,
    "grid": grid,
    "increments": increments,
    "harmonics": harmonics,
    "stops": stops,
    "full_slip": full_slip,
    "full_contact": full_contact,
}


def _whole_ticks(axis: Axes, places: Sequence[int]) -> None:
    """Label places of a logarithmic axis as they are."""
    axis.set_xticks(places, labels=[f"{place}" for place in places])
    axis.minorticks_off()


def main(names: list[str]) -> None:
    """Store the figures named, or all."""
    for name in names or FIGURES:
        began = time.perf_counter()
        with TemporaryDirectory() as folder:
            (picture,) = write_figures([(f"limit_{name}", FIGURES[name])], Path(folder))
            store(picture, ROOT / "docs" / "figures" / picture.name)
        print(f"{name}: {time.perf_counter() - began:.0f} s")  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
