"""Figures of unusual runs: nothing is cut, covered, empty or mostly white.

``figure_checks`` defines the requirements.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import h5py
import pytest
from matplotlib import rc_context
from matplotlib.figure import Figure

from sa_solver.types import Grid
from tests.workflow import conftest
from tests.workflow.chart.test_chart import charted
from tests.workflow.commands.test_loops_command import LOAD, record
from tests.workflow.output.figure_checks import problems
from tests.workflow.sweep.test_sweep import worn
from wear.joints.measured.measured_loops import measure_loops
from workflow.analyses.wear.figures.wear import figures_of
from workflow.analyses.wear.output.layout import WearContents
from workflow.chart import figures as chart_figures
from workflow.commands import loops_figure
from workflow.pictures.style import DOTS_PER_INCH, STYLE
from workflow.sweep import figures as sweep_figures
from workflow.sweep.table import varied_in

LONG = "fir_tree_lobe_1_pressure_side_leading_edge"
FIGURES = "resultants", "pressure_maps", "pressure_profiles", "worn_profiles", "kinetics"


@pytest.fixture(autouse=True)
def style() -> Iterator[None]:
    with rc_context(STYLE):
        yield


def wrong(figure: Figure) -> list[str]:
    """Return the problems of a figure that is drawn as by the writer."""
    figure.set_dpi(DOTS_PER_INCH)
    figure.draw_without_rendering()
    return problems(figure)


def scene(
    monkeypatch: pytest.MonkeyPatch,
    path: Path,
    size: tuple[float, float],
    names: tuple[str, ...],
    shape: tuple[int, int],
) -> tuple[Path, WearContents]:
    """Return synthetic results of some faces of a given size, with their contents."""
    loads = {name: 1.0 - 0.05 * number for number, name in enumerate(names)}
    monkeypatch.setattr(conftest, "SIZE", size)
    monkeypatch.setattr(conftest, "INTERFACES", loads)
    contents = replace(conftest.CONTENTS, names=tuple(sorted(names)), coarse=tuple(sorted(names)))
    write = conftest.fabricate if len(names) == 2 else many
    return write(path, shape), contents


def many(path: Path, shape: tuple[int, int]) -> Path:
    """Return results of one interface or many, with the parts that ``FIGURES`` need."""
    grid = Grid.covering((1.08 * conftest.SIZE[0], 1.05 * conftest.SIZE[1]), shape)
    with h5py.File(path, "w") as file:
        file.attrs.update(friction=conftest.FRICTION, peak_increment=conftest.PEAK)
        for name, load in conftest.INTERFACES.items():
            file.create_group(f"grid/{name}").attrs.update(shape=grid.shape, pitch=grid.pitch)
            conftest.put_structure(file, name, load, 0.0)
            conftest.put_contact(file, name, load, grid)
            conftest.put_kinetics(file, name, grid)
        conftest.put(file["kinetics"], cycles=conftest.JUMPS)
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "names", "shape"),
    [
        ((8.0, 60.0), ("intrados", "extrados"), (16, 40)),
        ((8.0, 8.0), ("interface",), (24, 24)),
        ((40.0, 6.0), (LONG, LONG.replace("1", "2")), (40, 16)),
        ((8.0, 60.0), tuple(f"flank_{number}" for number in range(5)), (8, 20)),
    ],
    ids=["slot", "square", "wide and long names", "five"],
)
def test_figures_of_wear(size, names, shape, monkeypatch, tmp_path):
    path, contents = scene(monkeypatch, tmp_path / "results.h5", size, names, shape)
    drawn = figures_of(contents)
    # Those of many faces take long.
    asked = {1: FIGURES, 2: tuple(drawn), 5: FIGURES[:2]}[len(names)]
    with h5py.File(path) as file:
        found = {name: wrong(drawn[name](file)) for name in asked}
    assert {name: what for name, what in found.items() if what} == {}


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
    assert [what for figure in drawn for what in wrong(figure)] == []
