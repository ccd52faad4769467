"""Comparisons of `docs/validation.md`: what was measured, and how a run gives it.

Nothing is fitted here: inputs are those that the publications print.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import floor, log10
from pathlib import Path
from typing import Any, Literal

import h5py
import numpy as np
from draw_gallery import ROOT

from sa_solver.types import Array

DATA = ROOT / "cases" / "validation"
# Half width of the middle of a scar, over which depths are averaged, and distance from the middle
# beyond which a profile is a rim [mm].
MIDDLE = {"mccoll_2004": 0.05, "cruzado_2010": 0.2}
RIM = {"mccoll_2004": 0.3, "cruzado_2010": 1.5}
MICROMETRE, PER_MICROMETRE, JOULE = 1e-3, 1e3, 1e3  # in mm, N/mm per N/µm, N mm


@dataclass(frozen=True)
class Run:
    """Run of a shipped case, with overrides of its entries."""

    case: str
    settings: tuple[str, ...] = ()


RUNS: Mapping[str, Run] = {
    "mccoll_2004": Run("validation/mccoll_2004"),
    "cruzado_2010": Run("validation/cruzado_2010"),
    "cruzado_800m": Run("validation/cruzado_2010", ("wear.cycles=100000", "measured=[]")),
    "cruzado_1600m": Run("validation/cruzado_2010", ("wear.cycles=200000", "measured=[]")),
    "cruzado_2400m": Run("validation/cruzado_2010", ("wear.cycles=300000", "measured=[]")),
    "llavori_2026": Run("validation/llavori_2026", ("output.paraview=false",)),
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

# Digits of values without an error, and relative error below which an error is not shown.
DIGITS, LEAST = 3, 1e-3


def number(value: float, around: float | None) -> str:
    """Return a value with its scatter or its error, which has two digits."""
    if around is None or around < LEAST * abs(value):
        shown = f"{value:.{DIGITS}g}" if abs(value) < 10**DIGITS else f"{value:.0f}"
        if around is None:
            return shown
        return f"{shown} (closed form)" if around == 0.0 else f"{shown} (error below 0.1 %)"
    decimals = max(0, 1 - floor(log10(around)))
    return f"{value:.{decimals}f} ± {around:.{decimals}f}"


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
    table = np.genfromtxt(DATA / f"{name}_profiles.csv", delimiter=",", comments="#", skip_header=5)
    places, rim = table[:, 0], RIM[name]
    depths = []
    for height in table[:, 1:].T:
        ends = [height[places < -rim].mean(), height[places > rim].mean()]
        depths.append(np.interp(places, [places[0], places[-1]], ends) - height)
    return places, np.array(depths)


def middle(name: str, places: Array, depth: Array) -> Array:
    """Return the depths in the middle of a scar."""
    return depth[..., np.abs(places) <= MIDDLE[name]]


def width_above(places: Array, depth: Array, level: float) -> float:
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
    width = width_above(places, depths[0], 0.5 * depth[0])
    return depth, (width, None), (float(areas(places, depths)[0]), None)


def measured_cruzado() -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    """Return the same of three tests, with their standard deviations."""
    places, depths = measured_profiles("cruzado_2010")
    inner = middle("cruzado_2010", places, depths).mean(axis=1)
    pairs = zip(depths, inner, strict=True)
    widths = np.array([width_above(places, depth, 0.5 * level) for depth, level in pairs])
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
        return width_above(places, depths[-1], level), float(places[1] - places[0])

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


WORN_AREA = at("interface.volume_1", 1e-3, "interface.error.volume.total")

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
    entries = {
        ("McColl 2004", "mccoll_2004", "flat"): (
            measured_mccoll(),
            "k was fitted to worn volumes; debris and roughness (0.2 µm) are not modelled",
            "as the area",
            "k is that of the whole scar, this is one profile; where its rims lie is uncertain",
        ),
        ("Cruzado 2010", "cruzado_2010", "block"): (
            measured_cruzado(),
            "form of the ring, given the volume",
            "form of the ring, given the volume; rough grooves",
            "k counts as fitted to these tests",
        ),
    }
    found = []
    for (test, name, body), (measured, *causes) in entries.items():
        wear = "groove" if body == "block" else "scar"
        results = (
            (f"depth in the middle of the {body} [µm]", scar_depth(name), "partly calibrated"),
            (f"width of the {wear} at half depth [mm]", scar_width(name), "partly calibrated"),
            (f"worn area of the {body} [1e-3 mm²]", WORN_AREA, "calibrated"),
        )
        for (quantity, computed, kind), value, cause in zip(results, measured, causes, strict=True):
            found.append(Comparison(test, quantity, value, name, computed, kind, cause))
    return found


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
