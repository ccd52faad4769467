"""Entries of templates are left out: they are refused by name, or ``check`` shows the default."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from tests.marks import slow
from tests.workflow.case.mutants import places, written
from workflow.case.sections import LAST, Case
from workflow.case.text.leaves import taken
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import kinds, load_case, parse_case, template

QUICK = "joint", "line"


def reported(case: Case) -> list[tuple[str, str]]:
    return [*case.outline(), *taken(case)]


def without(tree: Any, place: tuple[str | int, ...]) -> str:
    tree = copy.deepcopy(tree)
    around = tree
    for key in place[:-1]:
        around = around[key]
    del around[place[-1]]
    return written(tree)


@pytest.mark.parametrize("kind", [kind if kind in QUICK else slow(kind) for kind in kinds()])
def test_entries_left_out_are_missing_or_have_a_shown_default(
    kind: str, folders: dict[str, Path]
) -> None:
    name = str(folders[kind] / "case.yaml")
    tree = YAML(typ="safe", pure=True).load(template(kind))
    whole, unnamed = parse_case(written(tree), name), list[str]()
    for place in places(tree):
        if place[0] in ("title", *LAST):
            continue
        try:
            case = parse_case(without(tree, place), name)
        except CaseError as error:
            named = any(str(key) in str(error) for key in place)
        else:
            named = case == whole or reported(case) != reported(whole)
        if not named:
            unnamed.append(".".join(map(str, place)))
    assert not unnamed


def test_a_case_with_every_default_written_out_takes_none(dovetail_path: Path) -> None:
    case = load_case(dovetail_path, ["mesh={size: 6 mm}", "wear.step={}"])
    ((name, text),) = taken(case)
    assert name == "defaults"
    for entry in ("mesh.order 2", "wear.step.kind implicit", "accuracy 0.05"):
        assert entry in text.split(", ")
    assert "mesh.size" not in text
    assert "loops" not in text  # there are none
    assert taken(parse_case(dump_case(case), "case.yaml")) == []
