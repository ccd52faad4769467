"""Figures are complete, legible, not blank, and show numbers from the data."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.workflow.conftest import CONTENTS
from workflow.analyses.wear import ANALYSIS
from workflow.analyses.wear.figures import structure_stress
from workflow.analyses.wear.figures import wear as figures
from workflow.analyses.wear.figures.wear import figures_of
from workflow.pictures.drawing import write_figures

NAMES = {
    "resultants",
    "pressure_maps",
    "pressure_profiles",
    "worn_profiles",
    "kinetics",
    "error_budget",
    "structure_stress",
    "half_space_and_structure",
}


@pytest.fixture(scope="module")
def written(results: Path) -> list[Path]:
    assert ANALYSIS.pictures is not None
    return write_figures(ANALYSIS.pictures, CONTENTS, results, results.parent / "figures")


@pytest.fixture
def changed(results: Path, tmp_path: Path) -> Path:
    """Return a copy of the results, from which tests may remove parts."""
    copy = tmp_path / "results.h5"
    copy.write_bytes(results.read_bytes())
    return copy


def title(figure: Any) -> str:
    return str(figure.get_suptitle())


@pytest.mark.slow
def test_every_figure_is_written(written: list[Path]) -> None:
    assert {path.stem for path in written} == NAMES
    assert sorted(written) == sorted(written[0].parent.iterdir())


@pytest.mark.slow
def test_figures_are_wide_and_not_blank(written: list[Path]) -> None:
    from matplotlib.image import imread

    for path in written:
        assert np.any(imread(path)[..., :3] < 0.95, axis=-1).mean() > 0.02, path


def test_resultants_stay_inside_the_axes_and_the_coulomb_limits(results: Path) -> None:
    with h5py.File(results) as file:
        figure = figures.resultants(file, CONTENTS)
        peak = max(group["load_history/P"][()].max() for group in file["structure"].values())
        assert figure.axes[0].get_ylim()[1] >= peak / 1e3
        assert "64 %" in title(figure)  # 14 of 22 increments on either flank


def test_pressure_maps_share_one_scale_and_name_the_peaks(results: Path) -> None:
    with h5py.File(results) as file:
        figure = figures.pressure_maps(file, CONTENTS)
        for name, contact in file["contact"].items():
            first, last = contact["00000/pressure"][()].max(), contact["00006/pressure"][()].max()
            assert f"{name} {first:.0f} → {last:.0f} MPa" in title(figure)
    images = [image for axis in figure.axes for image in axis.images]
    assert len(images) == 4
    assert len({image.get_clim() for image in images}) == 1


def test_pressure_map_puts_x_up_and_y_right(changed: Path) -> None:
    with h5py.File(changed, "a") as file:
        pressure = file["contact/extrados/00000/pressure"]
        pressure[...] = 0.0
        pressure[-1, 0] = 100.0  # largest x, smallest y
        image = figures.pressure_maps(file, CONTENTS).axes[0].images[0]
    (row,), (column,) = np.nonzero(image.get_array().filled(0.0))
    assert image.origin == "lower"
    assert (row, column) == (image.get_array().shape[0] - 1, 0)


def test_profiles_show_all_three_methods(results: Path) -> None:
    with h5py.File(results) as file:
        figure = figures.pressure_profiles(file, CONTENTS)
        lines = {line.get_label(): line for line in figure.axes[0].lines}
        contact = file["contact/extrados"]
        middle = contact["00000/pressure"][()][:, 20]
        np.testing.assert_array_equal(lines["half-space 24 x 40, unworn"].get_ydata(), middle)
        assert len(lines["half-space 20 x 34, unworn"].get_xdata()) == 20
        # Two rows of 20 nodes lie next to y = 0.
        assert len(lines["finite elements, unworn"].get_xdata()) == 40
        peak = file["contact/intrados/00000/pressure"][()][:, 20].max()
        assert f"intrados at y = 0: {peak:.0f} MPa" in title(figure)


def test_kinetics_mark_what_is_extrapolated(results: Path) -> None:
    with h5py.File(results) as file:
        figure = figures.kinetics(file, CONTENTS)
        rate = file["kinetics/intrados"].attrs["depth_rate"]
    linear = figure.axes[1]
    assert "linear from 40,000 cycles" in linear.get_title()
    dashed = next(line for line in linear.lines if line.get_linestyle() == "--")
    np.testing.assert_allclose(dashed.get_xdata(), [1e5, 2e5])
    assert np.ptp(dashed.get_ydata()) == pytest.approx(1e3 * rate * 1e5)
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "both, extrapolated (not computed)" in names
    assert "linear regime" in names


def test_kinetics_without_a_linear_regime_extrapolate_nothing(results: Path) -> None:
    with h5py.File(results) as file:
        axis = figures.kinetics(file, CONTENTS).axes[0]
    assert "not yet linear at 100,000" in axis.get_title()
    assert all(line.get_linestyle() != "--" for line in axis.lines)


def test_stress_section_cuts_every_body_in_mid_slot(changed: Path) -> None:
    with h5py.File(changed, "a") as file:
        for body in file["bodies"].values():
            # Linear, so that the cut has it exactly; the part along the slot must vanish.
            body["unworn/von_mises"][...] = body["unworn/points"][()] @ [2.0, 100.0, 3.0]
        sections = structure_stress._sections(file, "unworn")
    assert sum(triangle_areas(section) for section in sections) == pytest.approx(2 * 50.0 * 60.0)
    for section in sections:
        np.testing.assert_allclose(section.stress, section.points @ [2.0, 3.0], rtol=1e-4)


def test_change_of_stress_is_shown_where_the_meshes_agree(changed: Path) -> None:
    with h5py.File(changed, "a") as file:
        figure = structure_stress.structure_stress(file, CONTENTS)
        panels = [axis.get_title() for axis in figure.axes if axis.get_title()]
        assert panels[:2] == ["unworn", "worn"]
        assert panels[2].startswith(structure_stress.CHANGE)
        # The synthetic stress falls by a tenth everywhere.
        for before, change in zip(
            structure_stress._sections(file, "unworn"),
            structure_stress._sections(file, structure_stress.CHANGE),
            strict=True,
        ):
            np.testing.assert_allclose(change.stress, -0.1 * before.stress, rtol=1e-4)
        file["bodies/disk/worn/elements"][0] = file["bodies/disk/worn/elements"][1]
        assert structure_stress._states(file) == ["unworn", "worn"]


def triangle_areas(section: Any) -> float:
    a, b, c = np.moveaxis(section.points[section.triangles], 1, 0)
    return float(0.5 * np.abs(np.linalg.det(np.stack([b - a, c - a], axis=-1))).sum())


def test_figures_are_those_of_what_a_run_has_written() -> None:
    bare = replace(CONTENTS, structure=False, coarse=(), comparison=False)
    assert set(figures_of(bare)) == NAMES - {"structure_stress", "half_space_and_structure"}
    assert "pressure_maps" not in figures_of(replace(CONTENTS, line=True))
    asked = replace(CONTENTS, loops=True, sections=True, cracking=CONTENTS.names)
    assert set(figures_of(asked)) == NAMES | {"loops", "subsurface_stress", "fretting_life"}


@pytest.mark.parametrize(
    ("group", "name"),
    [
        ("structure/intrados/load_history/Qx", "resultants"),
        ("contact/intrados/coarse", "pressure_profiles"),
        ("kinetics/intrados/area", "kinetics"),
        ("comparison/intrados/load_history", "half_space_and_structure"),
    ],
)
def test_what_should_be_there_and_is_not_is_an_error(changed: Path, group: str, name: str) -> None:
    with h5py.File(changed, "a") as file:
        del file[group]
        with pytest.raises(KeyError, match=group.split("/")[-1]):
            figures_of(CONTENTS)[name](file)


@pytest.mark.slow
def test_run_without_wear_can_be_drawn(changed: Path, tmp_path: Path) -> None:
    with h5py.File(changed, "a") as file:
        for name in file["grid"]:
            for jump in list(file["surfaces"][name])[1:]:
                del file["surfaces"][name][jump], file["contact"][name][jump]
    assert ANALYSIS.pictures is not None
    contents = replace(CONTENTS, jumps=0)
    written = write_figures(ANALYSIS.pictures, contents, changed, tmp_path / "figures")
    assert {path.stem for path in written} == NAMES
