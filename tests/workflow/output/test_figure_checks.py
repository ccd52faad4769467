"""Figures have titles, labels with units, no overlapping texts, no empty panel, finite limits."""

from collections.abc import Iterator
from pathlib import Path

import h5py
import pytest
from matplotlib import rc_context

from tests.workflow.chart.test_chart import charted
from tests.workflow.commands.test_loops_command import LOAD, record
from tests.workflow.conftest import CONTENTS
from tests.workflow.output.figure_checks import laid_out, problems
from tests.workflow.sweep.test_sweep import worn
from wear.joints.measured.measured_loops import measure_loops
from workflow.analyses.wear.figures.wear import figures_of
from workflow.chart import figures as chart_figures
from workflow.commands import loops_figure
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import STYLE
from workflow.sweep import figures as sweep_figures
from workflow.sweep.table import varied_in


@pytest.fixture(autouse=True)
def style() -> Iterator[None]:
    with rc_context(STYLE):
        yield


def test_checks_find_what_is_missing_or_illegible() -> None:
    """A figure with everything has no problems; each thing that is left out is found."""

    def drawn(title: str = "A line", label: str = "x [mm]", at: float = 0.1) -> list[str]:
        figure = new_figure(title, 4.0)
        axis = figure.subplots()
        axis.plot([0.0, 1.0], [0.0, 1.0])
        axis.set(xlabel=label, ylabel="cycles")
        axis.text(0.1, 0.5, "a note")
        axis.text(at, 0.5, "another note")
        return problems(laid_out(figure))

    assert drawn(at=0.5) == []
    assert drawn(at=0.5, title="") == ["no title"]
    assert drawn(at=0.5, label="x") == ["no label with a unit along x: cycles, x"]
    assert drawn() == ["texts overlap: 'a note' and 'another note'"]


@pytest.mark.parametrize("count", [3, 10, 24])
def test_legends_of_many_entries_have_several_rows(count: int) -> None:
    figure = new_figure("Many lines", 4.0)
    axis = figure.subplots()
    for number in range(count):
        axis.plot([0.0, 1.0], [0.0, number], label=f"line {number}" + number % 3 * " longer")
    axis.set(xlabel="x [mm]", ylabel="cycles")
    legend_below(figure, [axis])
    assert problems(laid_out(figure)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", figures_of(CONTENTS))
def test_figures_of_wear(name: str, results: Path) -> None:
    with h5py.File(results) as file:
        assert problems(laid_out(figures_of(CONTENTS)[name](file))) == []


@pytest.mark.slow
def test_figures_of_sweeps_charts_and_loops() -> None:
    rows = [worn(depth) for depth in (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)]
    title = "Dovetail in plane strain with a title of many words, inputs as uncertain as they are"
    panels = sweep_figures._panels(rows, ["flank"])
    chart = charted(0.1)
    time, displacement, force = record()
    loops = measure_loops(displacement, force, LOAD, time)
    drawn = [
        sweep_figures.kinetics_bands(title, rows, ["flank"]),
        *(sweep_figures.against(title, varied, panels) for varied in varied_in(rows)),
        *(chart_figures.axis_figure(ladder, chart.accuracy) for ladder in chart.ladders),
        chart_figures.all_figure(chart),
        loops_figure.figure(loops, "a_measurement_with_a_name_that_is_rather_long.csv"),
    ]
    assert [what for figure in drawn for what in problems(laid_out(figure))] == []
