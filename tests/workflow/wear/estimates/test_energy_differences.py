"""Tests of warnings that the energies of loads differ from those of the half-space."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.conftest import CASES
from wear.contact.interface import FirstContact
from workflow.analyses.wear.checks.warnings import warn_of_contact
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.structures.resultants.model import given_loads
from workflow.analyses.wear.translation import face_contact
from workflow.kinds import load_case, parse_case, template
from workflow.messages.warning_kinds import WarningKind
from workflow.models.structure import StructureLoads
from workflow.shell.terminal.reporter import Reporter

# A cylinder that is sheared back and forth below its limit: ends slip, the middle sticks.
ROWS = "P [N/mm],Qx [N/mm],My [N],Edx [N mm/mm]\n1000,300,0,{}\n1000,-300,0,{}\n"
SETTINGS = [
    *("structure.dimension=2", "structure.size=3", "contact.grid=[64, 8]"),
    "structure.gap={shape: paraboloid, radius_x: 20 mm}",
    "friction.coefficient=0.4",
]
COARSE = [
    "mesh={flank_nodes: [12, 10], size: 8 mm, order: 1}",
    *("contact.grid=[64, 64]", "load_path.increments=[3, 5]", "contact.method=full"),
]


def begun(source, stage, loads):
    state, first = stage.contact.begin(loads, 1.0)
    return source, stage, state, first


def of_file(folder: Path, energy: float):
    (folder / "loads.csv").write_text(ROWS.format(energy, energy), encoding="utf-8")
    case = parse_case(template("resultants"), str(folder / "case.yaml"), SETTINGS)
    source = given_loads(case)
    return case, *begun(source, face_contact(case, source.faces[0]), source.unworn()[0])


def warnings_of(folder, case, source, stage, state, first) -> list[str]:
    """Return the warnings about energies."""
    reporter = Reporter(folder / "log")
    warn_of_contact(case, source, [(stage, state)], [first], reporter)
    return [line for line in reporter.warnings if WarningKind.ENERGIES_DIFFER.code in line]


def test_energies_of_a_file_that_the_half_space_contradicts(tmp_path):
    case, *contact, first = of_file(tmp_path, 18.0)
    found = first.energy.sum()
    assert 0.0 < found < 1.0
    (line,) = warnings_of(tmp_path, case, *contact, first)
    assert f"36 N of dissipated energy per cycle, but the half-space finds {found:.3g}" in line
    # The half-space's own are believed, and so are those of a mesh that is a little coarse.
    for factor in (1.0, 1.2, 0.8):
        scene = of_file(tmp_path, 0.5 * factor * found)
        assert warnings_of(tmp_path, *scene) == []


@pytest.mark.parametrize(("share", "warned"), [(1.0, False), (0.5, False), (1.7e-4, True)])
def test_nodes_that_dissipate_what_the_half_space_does_not(tmp_path, share, warned):
    """Method full wears by the half-space's energies: 0.006, where the nodes have 36."""
    case = load_case(CASES / "dovetail_2d.yaml", COARSE)
    source = loads_of(case)
    assert isinstance(source, StructureLoads)
    scene = begun(source, face_contact(case, source.faces[0]), source.unworn()[0])
    first: FirstContact = scene[-1]
    less = replace(first, energy=share * first.energy)
    lines = warnings_of(tmp_path, case, *scene[:-1], less)
    assert len(lines) == warned
    if warned:
        assert f"by which the contact wears, {less.energy.sum():.3g}" in lines[0]
