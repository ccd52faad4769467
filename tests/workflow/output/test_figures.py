"""Figures are complete, legible, not blank, and show numbers from the data."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.workflow.conftest import CONTENTS
from workflow.analyses.wear.figures import structure_stress
from workflow.analyses.wear.figures import wear as figures
from workflow.analyses.wear.figures.wear import figures_of

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


@pytest.fixture
def changed(results: Path, tmp_path: Path) -> Path:
    """Return a copy of the results, from which tests may remove parts."""
    copy = tmp_path / "results.h5"
    copy.write_bytes(results.read_bytes())
    return copy


def test_pressure_map_puts_x_up_and_y_right(changed: Path) -> None:
    with h5py.File(changed, "a") as file:
        pressure = file["contact/extrados/00000/pressure"]
        pressure[...] = 0.0
        pressure[-1, 0] = 100.0  # largest x, smallest y
        image = figures.pressure_maps(file, CONTENTS).axes[0].images[0]
    (row,), (column,) = np.nonzero(image.get_array().filled(0.0))
    assert image.origin == "lower"
    assert (row, column) == (image.get_array().shape[0] - 1, 0)


def test_profiles_show_the_pressure_in_the_middle(results: Path) -> None:
    with h5py.File(results) as file:
        figure = figures.pressure_profiles(file, CONTENTS)
        lines = {line.get_label(): line for line in figure.axes[0].lines}
        middle = file["contact/extrados/00000/pressure"][()][:, 20]
    np.testing.assert_array_equal(lines["half-space 24 x 40 cells, unworn"].get_ydata(), middle)


def test_kinetics_are_extrapolated_at_their_rate(results: Path) -> None:
    with h5py.File(results) as file:
        figure = figures.kinetics(file, CONTENTS)
        rate = file["kinetics/intrados"].attrs["depth_rate"]
    dashed = next(line for line in figure.axes[1].lines if line.get_linestyle() == "--")
    np.testing.assert_allclose(dashed.get_xdata(), [1e5, 2e5])
    assert np.ptp(dashed.get_ydata()) == pytest.approx(1e3 * rate * 1e5)


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
