"""The schema for editors is standard, fully described, and accepts every valid case."""

import json

import jsonschema
import pytest
from ruamel.yaml import YAML

from tests.conftest import CASES
from tests.marks import slow
from tests.workflow.case.mutants import Mutants, sources
from tests.workflow.command_line import invoke
from workflow.case.source import Source
from workflow.errors import CaseError
from workflow.fit.template import FITS, fit_template
from workflow.kinds import about, kinds, parse_case, template
from workflow.sweep.template import sweep_template

FILES = sorted(
    path for folder in ("", "sweeps/", "validation/") for path in CASES.glob(f"{folder}*.yaml")
)


@pytest.fixture(scope="module")
def schema():
    ending = invoke("schema")
    assert ending.exit_code == 0
    return json.loads(ending.stdout)


@pytest.fixture(scope="module")
def validator(schema):
    return jsonschema.Draft202012Validator(schema)


def text_of(kind):
    if kind in FITS:
        return fit_template(kind)
    return sweep_template() if kind == "sweep" else template(kind)


def plain(text):
    return YAML(typ="safe", pure=True).load(text)


def test_every_entry_is_described(schema):
    bare = [
        f"{name}.{key}"
        for name, definition in schema["$defs"].items()
        for section in (definition, *definition.get("anyOf", ()))
        for key, entry in section.get("properties", {}).items()
        if not entry.get("description")
    ]
    assert not bare


@pytest.mark.parametrize("kind", kinds())
def test_fixed_words_distinguish_the_kinds(schema, kind):
    """An editor then proposes only the entries of the kind."""
    (case,) = [d for d in schema["$defs"].values() if d.get("title") == kind]
    assert case["description"] == about()[kind]
    assert case["additionalProperties"] is False
    assert "const" in case["properties"]["analysis"]
    structure = case["properties"]["structure"]
    for one in structure.get("oneOf", [structure]):
        of_one = schema["$defs"][one["$ref"].rpartition("/")[2]]
        assert "const" in of_one["properties"]["kind"]
        assert "kind" in of_one["required"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_shipped_files_are_valid(validator, path):
    assert validator.is_valid(plain(path.read_text("utf-8")))


@pytest.mark.parametrize("kind", [*kinds(), "sweep", *FITS])
def test_templates_are_valid(validator, kind):
    assert validator.is_valid(plain(text_of(kind)))


@pytest.mark.parametrize(
    ("kind", "old", "new"),
    [
        ("dovetail", "analysis: wear", "analysis: contact"),
        ("dovetail", "flank_angle: 45 deg", "flank_angle: 5,3 mm"),
        ("dovetail", "flank_angle: 45 deg", "flank_angel: 45 deg"),
        ("dovetail", "grid: [96, 192]", "grid: [96, 192, 1]"),
        ("dovetail", "    young: 115 GPa", "    # young: 115 GPa"),
        ("bodies", "shape: sphere", "shape: cylinder"),
        ("vibration", "forces: [10 N, 40 N]", "forces: 10 N"),
        ("dovetail", "slot_length: 60 mm", "slot_length: -60 mm"),
        ("sweep", "values: [0.3, 0.4, 0.5]", "value: 0.3"),
        ("fit_wear", "law: energy ", "law: archard "),
    ],
)
def test_wrong_files_are_invalid(validator, kind, old, new):
    text = text_of(kind)
    assert old in text
    assert not validator.is_valid(plain(text.replace(old, new, 1)))


# Mutants whose data the schema is asked about, too: those that keep the case apart from their text.
MUTANTS = 60


@pytest.mark.parametrize("block", [0, *map(slow, range(1, 16))])
def test_whatever_the_loader_takes_is_valid(validator, block, folders):
    """The schema may be less strict than the loader, but never stricter."""
    mutants, wrong = Mutants(sources()), []
    name = str(folders["resultants"] / "mutant.yaml")
    for number in range(block * MUTANTS, (block + 1) * MUTANTS):
        mutant = mutants[number]
        try:
            text = mutant.text.decode()
            parse_case(text, name)
            data = json.loads(json.dumps(Source(name, text).data))
        except (CaseError, UnicodeDecodeError, ValueError):
            continue
        if not validator.is_valid(data):
            wrong.append(f"{number}: {mutant.reported}")
    assert not wrong


@pytest.mark.parametrize(
    ("body", "valid"),
    [
        ("Ti-6Al-4V", True),
        ({"material": "100Cr6", "young": "210 GPa"}, True),
        ("steel", False),
        ({"young": 1e5}, False),
    ],
)
def test_a_body_has_a_name_or_numbers(validator, body, valid):
    case = plain(template("bodies"))
    case["materials"]["body_1"] = body
    assert validator.is_valid(case) is valid


@pytest.mark.parametrize(
    ("entries", "valid"),
    [
        ({"coefficient": 1e-4, "hardness": "3 GPa"}, True),
        ({"specific_wear_rate": "1e-5 mm^3/(N*m)"}, True),
        ({"coefficient": 1e-4}, False),
        ({"coefficient": 1e-4, "hardness": "3 GPa", "specific_wear_rate": 1e-8}, False),
    ],
)
def test_archard_has_k_once(validator, entries, valid):
    case = plain(template("bodies_wear"))
    case["wear"]["body_1"] = {"law": "archard"} | entries
    assert validator.is_valid(case) is valid
