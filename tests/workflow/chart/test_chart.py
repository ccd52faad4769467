"""Tests of charts without runs: frontier, Richardson, ladders, costs with a cache, axes."""

from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest

from sa_solver.types import Grid
from tests.marks import slow
from workflow.analyses.wear.approximations.approximation import Approximation, Rung
from workflow.analyses.wear.output.measures import profile_difference
from workflow.case.text.writing import dump_case
from workflow.chart import Chart
from workflow.chart.axes import AXES, axes_of
from workflow.chart.costs import RunCost, costs
from workflow.chart.frontier import Option, cheapest, efficient
from workflow.chart.ladder import Point, judge
from workflow.errors import UserError
from workflow.kinds import load_case
from workflow.models.budget.convergence import richardson

# --- frontier -----------------------------------------------------------------------------------


def test_efficient_points_are_those_that_nothing_beats_in_both():
    random = np.random.default_rng(1)
    spent, errors = random.uniform(size=(2, 60)).round(1).tolist()
    flags = efficient(spent, errors)
    points = list(zip(spent, errors, strict=True))
    for (cost, error), flag in zip(points, flags, strict=True):
        beaten = any(c <= cost and e <= error and (c, e) != (cost, error) for c, e in points)
        assert not (flag and beaten)
    # Whatever is asked for, an efficient point is as cheap as any that will do.
    for accuracy in np.linspace(min(errors), 1.0, 20):
        best = min(c for c, e in points if e <= accuracy)
        kept = [c for (c, e), flag in zip(points, flags, strict=True) if flag and e <= accuracy]
        assert min(kept) == best


def test_cheapest_combination_is_that_of_an_exhaustive_search():
    random = np.random.default_rng(2)
    axes = {
        axis: [
            Option(f"{axis}{k}", *random.uniform((0.2, 0), (3, 0.02)).tolist()) for k in range(5)
        ]
        for axis in "abcd"
    }
    everything = list(product(*axes.values()))
    for accuracy in (0.02, 0.03, 0.05):
        met = [c for c in everything if sum(option.error for option in c) <= accuracy]
        best = min(np.prod([option.ratio for option in c]) for c in met)
        choice = cheapest(axes, accuracy)
        assert choice is not None
        assert choice.seconds_ratio == pytest.approx(best, rel=1e-12)
        assert choice.error <= accuracy
        assert all(rung.startswith(axis) for axis, rung in choice.rungs.items())
        assert list(choice.rungs) == list("abcd")
    assert cheapest(axes, 1e-6) is None


# --- Richardson ---------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [(4.0, 2.0, 1.0), (5.0, 2.5, 2.0), (0.3, 0.2, 0.1)])
@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
def test_richardson_finds_order_and_limit_of_a_power(steps: tuple[float, ...], order: float):
    values = [3.0 - 0.7 * h**order for h in steps]
    convergence = richardson(values, steps, order=2.0)
    assert convergence.order == pytest.approx(order, rel=1e-9)
    assert convergence.error == pytest.approx(3.0 - values[-1], rel=1e-9)


def test_an_order_above_what_is_believed_is_not_used():
    values = [1.0 + h**4 for h in (4.0, 2.0, 1.0)]
    convergence = richardson(values, (4.0, 2.0, 1.0), order=2.0)
    assert convergence.order == pytest.approx(4.0)
    assert convergence.error == pytest.approx((values[1] - values[2]) / 3.0)
    assert convergence.error > abs(values[-1] - 1.0)


def test_values_that_swing_to_a_limit_have_it_between_the_last_two():
    convergence = richardson([1.4, 0.8, 1.1], (4.0, 2.0, 1.0), order=2.0)
    assert convergence.order is None
    assert convergence.error == pytest.approx(0.3)


def test_values_that_do_not_settle_are_known_to_their_spread():
    convergence = richardson([1.0, 1.1, 0.7], (4.0, 2.0, 1.0), order=2.0)
    assert convergence.order is None
    assert convergence.error == pytest.approx(0.4)


def test_rounding_is_no_convergence():
    convergence = richardson([1.0, 1.0 + 2e-16, 1.0], (4.0, 2.0, 1.0), order=2.0, noise=1e-12)
    assert convergence.order is None
    assert convergence.error < 1e-12


def test_few_rungs_say_little():
    assert richardson([1.0, 1.2], (2.0, 1.0), order=2.0).error == pytest.approx(0.2)
    assert richardson([1.0], (1.0,), order=2.0).error == np.inf


# --- ladders ------------------------------------------------------------------------------------

GRID, METHOD = (next(axis for axis in AXES if axis.name == name) for name in ("grid", "method"))


def point(name: str, step: float | None, values: dict[str, float], seconds: float) -> Point:
    """Return a rung that took ten convolutions per second; ``own`` is the case as written."""
    cost = RunCost(seconds, round(10 * seconds), 1)
    return Point(Rung(name, {"a": name}, step), name == "own", name, values, cost)


def test_a_busy_machine_changes_no_choice():
    """A coarser grid is chosen even if it seems to take longer than a finer one."""
    errors = {"16": 0.3, "32": 0.008, "64": 0.002, "128": 0.0005}
    seconds = {"16": 2.0, "32": 5.0, "64": 4.0, "128": 6.0}
    points = [
        point(name, 1.0 / int(name), {"depth": 1.0 + error}, seconds[name])
        for name, error in errors.items()
    ]
    ladder = judge(GRID, points, {"depth": 1.0}, {})
    for accuracy, name in {0.01: "32", 0.005: "64", 0.001: "128"}.items():
        chosen = ladder.cheapest(accuracy)
        assert chosen is not None
        assert chosen.name == name
    assert ladder.scatter == pytest.approx(5.0 / 4.0 - 1.0)
    assert [rung.seconds for rung in ladder.rungs] == [2.0, 4.0, 4.0, 6.0]
    # Two ways to the same error, apart by less than the clock has shown to be wrong.
    ways = [point(name, None, {"depth": 1.0}, spent) for name, spent in (("a", 3.0), ("b", 3.5))]
    ways[0] = replace(ways[0], cost=RunCost(3.0, 100, 1))
    both = judge(GRID, [*points, *ways], {"depth": 1.0}, {})
    chosen = both.cheapest(1e-4)
    assert chosen is not None
    assert chosen.name == "b"


def second_order(closed: float = 1.0) -> list[Point]:
    """Return a ladder with depth = closed + h² and volume = 2 + h."""
    names = {"coarse": 0.4, "own": 0.2, "fine": 0.1}
    return [
        point(name, h, {"depth": closed + h**2, "volume": 2.0 + h}, 1.0 / h)
        for name, h in names.items()
    ]


def test_the_last_rung_is_the_reference_and_known_to_its_estimated_error():
    ladder = judge(GRID, second_order(), {}, {})
    assert ladder.references["depth"].order == pytest.approx(2.0)
    assert ladder.references["depth"].floor == pytest.approx(0.01 / 1.01)
    assert ladder.references["volume"].order == pytest.approx(1.0)
    assert ladder.floor == pytest.approx(0.1 / 2.1)
    coarse, middle, fine = ladder.rungs
    assert coarse.error == pytest.approx(0.15 / 1.01)
    assert coarse.worst == "depth"
    assert (fine.error, fine.unresolved) == (0.0, True)
    assert fine.bound == pytest.approx(ladder.floor)
    # 0.1 / 2.1 apart from a value that is known no better than that.
    assert middle.error == pytest.approx(0.1 / 2.1)
    assert middle.bound >= (2.2 - 2.0) / 2.1
    assert [rung.by_seconds for rung in ladder.rungs] == [True, True, True]


def test_a_closed_form_is_the_reference_where_the_axis_goes_to_it():
    exact = {"depth": 1.0, "volume": 2.0}
    ladder = judge(GRID, second_order(), exact, {})
    assert ladder.floor == 0.0
    assert [rung.error for rung in ladder.rungs] == pytest.approx([0.2, 0.1, 0.05])
    # A choice has no limit that a closed form would be.
    assert judge(METHOD, second_order(), exact, {}).rungs[-1].error == 0.0


def test_the_bound_holds_against_the_true_limit():
    ladder = judge(GRID, second_order(), {}, {})
    for rung in ladder.rungs:
        values = rung.values
        true = max(abs(values["depth"] - 1.0) / 1.0, abs(values["volume"] - 2.0) / 2.0)
        assert rung.bound == pytest.approx(true, rel=0.15)


def charted(accuracy: float) -> Chart:
    points = [point("own", None, {"depth": 1.001}, 2.0), point("full", None, {"depth": 1.0}, 9.0)]
    method = judge(METHOD, points, {}, {"broken": "no convergence"})
    return Chart("Test", (judge(GRID, second_order(), {"volume": 2.0}, {}), method), accuracy)


# --- measures -----------------------------------------------------------------------------------

LOG = """\
10:00:00 run: a title: 12.00 s
10:00:01 mesh: 0.50 s
10:00:09 condensation: {condensation} s
10:00:12 structural friction: {unworn} s
10:00:14 wear: 1.00 s
10:00:14 jump 1: 1000 cycles, depths [[1. 1.]] um, 20 convolutions, drift 3.00%
10:00:15 structural friction: 2.50 s
10:00:16 wear: 1.25 s
10:00:17 paraview and figures: 7.00 s
"""


def test_what_is_found_in_the_cache_costs_what_it_took_to_compute(tmp_path: Path, small_path: Path):
    """The second run shares all structural work, the third only the condensation."""
    overrides = ((), ("contact.grid=[16, 32]",), ("load_path.increments=[9, 15]",))
    cases = [load_case(small_path, entries) for entries in overrides]
    logged = ("8.00", "3.00"), ("0.10", "0.20"), ("0.10", "6.00")
    folders = [tmp_path / str(number) for number in range(3)]
    for folder, (condensation, unworn) in zip(folders, logged, strict=True):
        folder.mkdir()
        log = LOG.format(condensation=condensation, unworn=unworn)
        (folder / "run.log").write_text(log, encoding="utf-8")
    work = {"work": {"convolutions": 20, "contact_solves": 3}}
    first, second, third = costs(cases, folders, [work] * 3)
    whole = 0.5 + 8.0 + 3.0 + 1.0 + 2.5 + 1.25
    assert first == RunCost(pytest.approx(whole), 20, 3)
    assert second.seconds == pytest.approx(whole)
    assert third.seconds == pytest.approx(whole + 3.0)


@pytest.mark.parametrize("line", [False, True])
def test_depth_anywhere_is_compared_across_grids(line: bool):
    """A smooth field on two grids differs by the interpolation; a bump by its height."""

    def depths(cells: int, bump: float) -> dict[str, tuple[Grid, np.ndarray, np.ndarray]]:
        shape = (cells, 1 if line else cells)
        grid = Grid(shape, (2.0 / cells, 1.0 if line else 2.0 / cells), line)
        field = np.cos(grid.x) * (1.0 if line else np.cos(grid.y))
        field[cells // 2, 0 if line else cells // 2] += bump
        return {"face": (grid, field, field)}

    assert profile_difference(depths(32, 0.0), depths(128, 0.0)) == pytest.approx(0.0, abs=1e-3)
    assert profile_difference(depths(32, 0.1), depths(128, 0.0)) == pytest.approx(0.1, abs=2e-3)


# --- axes ---------------------------------------------------------------------------------------

FOLDER = Path(__file__).parents[3] / "cases"
CASES = sorted([*FOLDER.glob("*.yaml"), *FOLDER.glob("validation/*.yaml")])
# Of a joint alone nothing can be charted: its test is as good as it is asked to be.
CHARTED = [path for path in CASES if "kind: joint" not in path.read_text("utf-8")]


# One case of each analysis; all others are for `make test-full`.
QUICK = "dovetail_2d", "sphere_fretting", "specimens_coarse", "rig_two_dof", "rig_wear_vibration"


@pytest.mark.parametrize(
    "path",
    [path if path.stem in QUICK else slow(path) for path in CHARTED],
    ids=[path.stem for path in CHARTED],
)
def test_every_rung_of_every_case_is_another_case_and_finer(path: Path):
    written = dump_case(load_case(path))
    for axis, settings in axes_of(path, (), ()).items():
        texts = [setting.text for setting in settings]
        assert len(set(texts)) == len(texts) > 1
        assert written in texts
        names = [setting.rung.name for setting in settings]
        assert len(set(names)) == len(names)
        _check_steps(axis, settings)


def _check_steps(axis: Approximation, settings: list) -> None:
    """Assert that the rungs of a branch go from coarse to fine."""
    branches: dict[str, list[float]] = {}
    for setting in settings:
        if setting.rung.step is not None:
            branches.setdefault(setting.rung.branch, []).append(setting.rung.step)
    for steps in branches.values():
        assert all(one > other for one, other in pairwise(steps))
    assert axis.order is not None or not branches


@pytest.mark.parametrize(
    ("case", "expected"),
    [
        ("sphere_fretting", {"grid", "tolerance", "history"}),
        ("line_dissimilar", {"grid", "tolerance", "history"}),
        (
            "dovetail",
            {
                *("grid", "tolerance", "method", "stepper", "dimension"),
                *("coupling", "increments", "link", "mesh", "slot", "order"),
            },
        ),
        ("specimens_flat", {"grid", "tolerance", "mesh", "order"}),
    ],
)
def test_axes_that_apply(case: str, expected: set[str]):
    path = next(path for path in CASES if path.stem == case)
    assert {axis.name for axis in axes_of(path, (), ())} == expected


def test_axes_that_do_not_apply_are_refused():
    path = next(path for path in CASES if path.stem == "sphere_fretting")
    for name in ("mesh", "gird"):
        with pytest.raises(UserError, match=f"--axis {name}"):
            axes_of(path, (), ("grid", name))
