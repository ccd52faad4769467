"""The numbers of "Cost against size" are those measured, and current."""

import csv
import re
import sys
from pathlib import Path

import numpy as np
import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "cost.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def cost():
    """Return the scripts of the page, which are no package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(DOCS), *sys.path])
        import cost_charts
        import cost_works

        yield cost_charts, cost_works


def test_every_work_was_measured_and_is_on_the_page(cost):
    charts, works = cost
    measured = []
    for name, chart in charts.CHARTS.items():
        points = charts.stored(name)
        assert f"figures/cost_{name}.csv" in PAGE
        assert f"figures/cost_{name}.png" in PAGE
        for line in chart.lines:
            assert len(points[line.work]["size"]) == len(line.sizes), line.work
            assert np.all(np.diff(points[line.work]["size"]) > 0)
            assert np.all(points[line.work]["seconds"] > 0.0)
            measured.append(line.work)
    assert sorted(measured) == sorted(works.WORKS)


def test_how_large_follows_from_the_points(cost):
    charts, _ = cost
    with (DOCS / "figures" / "cost_limits.csv").open(encoding="utf-8", newline="") as file:
        assert list(csv.reader(file)) == charts.limits()


def test_powers_in_words_are_those_of_the_points(cost):
    """All exponents are listed in comments at the end of the page."""
    charts, _ = cost
    reported = re.findall(r"^% (\w+) (\w+) (\d\.\d)$", PAGE, flags=re.MULTILINE)
    assert len(reported) >= 5
    places = {line.work: name for name, chart in charts.CHARTS.items() for line in chart.lines}
    for work, measure, power in reported:
        points = charts.stored(places[work])[work]
        seen = charts._seen(measure, points[measure])
        found = charts.slope(points["size"][seen], points[measure][seen])
        assert found == pytest.approx(float(power), abs=0.06)
        assert f"power {power}" in PAGE
    ratios = re.findall(r"^% (\w+) over (\w+): (\d+) to (\d+)$", PAGE, flags=re.MULTILINE)
    assert len(ratios) == 2
    for work, other, least, most in ratios:
        one, two = (charts.stored(places[name])[name]["seconds"] for name in (work, other))
        shared = min(len(one), len(two))
        found = one[:shared] / two[:shared]
        assert (f"{found.min():.0f}", f"{found.max():.0f}") == (least, most)
        assert f"{least} to {most}" in PAGE.replace("\n", " ")


@pytest.mark.parametrize("work", ["normal", "friction", "unlike"])
def test_contacts_take_as_many_convolutions_still(cost, work):
    charts, works = cost
    points = charts.stored("contact")[work]
    make, _ = works.WORKS[work]
    size = int(points["size"][0])
    assert make(size).run() == pytest.approx(points["count"][0], rel=0.15)


@pytest.mark.parametrize("power", [1.0, 2.5])
def test_a_slope_is_that_of_the_upper_half(cost, power):
    charts, _ = cost
    size = 2.0 ** np.arange(6)
    seconds = 0.1 * size**power
    seconds[:3] = 5.0
    assert charts.slope(size, seconds) == pytest.approx(power)
    assert charts.slope(size[:2], seconds[:2]) is None
