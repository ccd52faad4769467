"""The same thing has the same name in every analysis."""

import pytest

from tests.conftest import CASES
from tests.workflow.scenes import ROLLER_LOADS, ROLLER_WEAR
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import load_case, parse_case

LINES = ["line_dissimilar", "line_bulk_stress", "cylinder_wear", "dovetail_2d"]
AREAS = ["sphere_normal", "sphere_wear", "dovetail_small"]


@pytest.mark.parametrize("name", LINES)
def test_grids_of_line_contacts_are_a_number_or_one_row(name):
    alone, row = (
        load_case(CASES / f"{name}.yaml", [f"contact.grid={grid}"]) for grid in ("64", "[64, 1]")
    )
    assert alone == row
    assert alone.contact.grid == (64, 1)
    text = dump_case(alone)
    assert parse_case(text, str(CASES / "dump")) == alone


@pytest.mark.parametrize("name", AREAS)
@pytest.mark.parametrize("grid", ["64", "[64, 1]", "[64]", "64 x 64"])
def test_grids_of_areas_are_two_numbers(name, grid):
    with pytest.raises(CaseError) as refused:
        load_case(CASES / f"{name}.yaml", [f"contact.grid={grid}"])
    (line,) = str(refused.value).splitlines()
    assert line.startswith("--set contact.grid=")
    assert "; allowed: " in line


@pytest.mark.parametrize(
    ("name", "override", "reported"),
    [
        ("specimens_coarse", "load_path.P=60 N", "allowed: normal_forces, one after the other"),
        ("dovetail_2d", "load_path.peak_at=8", "the first leg of increments: [8, 14]"),
        ("sphere_wear", "materials.body_1.density=1e-9", "nothing here depends on mass"),
        ("sphere_wear", "wear.body_1.specific_wear_rate=1e-9", "coefficient, which is that rate"),
    ],
)
def test_the_key_of_another_case_is_answered_with_ours(name, override, reported):
    with pytest.raises(CaseError) as refused:
        load_case(CASES / f"{name}.yaml", [override])
    (line,) = str(refused.value).splitlines()
    assert line.startswith(f"--set {override}: ")
    assert reported in line


def test_cases_of_the_plane_take_one_size(tmp_path):
    (tmp_path / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    for size in ("1.6 mm", "[1.6 mm, 9 mm]"):
        name, overrides = str(tmp_path / "roller.yaml"), [f"structure.size={size}"]
        case = parse_case(ROLLER_WEAR, name, [*overrides, "contact.grid=32"])
        assert case.structure.size_of("interface") == (1.6, 1.0)
        assert parse_case(dump_case(case), name) == case
