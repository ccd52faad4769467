"""The same thing has the same name in every analysis."""

import pytest

from tests.conftest import CASES
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
