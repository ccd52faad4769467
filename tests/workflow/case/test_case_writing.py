"""Written cases are read back unchanged; the template is the default case."""

import json

import pytest
from ruamel.yaml import YAML

from workflow.case.sections import sections_of
from workflow.case.text.writing import dump_case
from workflow.kinds import kinds, load_case, parse_case, template

AWKWARD = ["yes", "null", "1e5", "12:30", "a: b", "# no", "- x", "ü µ", "'", '"', "\\n", "{", "~"]


@pytest.mark.parametrize(
    "overrides",
    [
        [],
        ["materials.blade.yield_stress=", "wear.stop={depth: 0.1 mm}", "assumed=[]"],
        ["wear.step={kind: explicit, volume: 1e-7 mm^3}", "structure.skew=-29.999 deg"],
        ["nonlinearity={stiffness: relinearised, check: true}", "fidelity=auto"],
        [
            "expect=[{quantity: a.b-1.0, value: -1.23456789e-7, tolerance: 0.1 %, "
            "kind: earlier, source: a}]"
        ],
        *([f"title={json.dumps(title)}"] for title in AWKWARD),
    ],
)
def test_dump_reads_back_equal(dovetail_path, overrides):
    case = load_case(dovetail_path, overrides)
    text = dump_case(case)
    assert parse_case(text, "dump") == case
    assert dump_case(parse_case(text, "dump")) == text


def test_dump_has_every_default(dovetail_path, dovetail_text):
    start = dovetail_text.index("mesh:")
    short = dovetail_text[:start] + dovetail_text[dovetail_text.index("wear:") :]
    written = YAML(typ="safe").load(dump_case(parse_case(short, "short")))
    assert written["mesh"] == {"flank_nodes": [21, 27], "size": 12.0, "notch": 16, "order": 2}
    assert written["contact"] == {
        "grid": [96, 192],
        "method": "normal",
        "link": "corrected",
        "gross_slip": "force",
    }
    assert parse_case(short, "short") == load_case(dovetail_path)


def test_numbers_are_numbers_in_every_yaml(dovetail_path):
    """YAML 1.1, which most other readers implement, reads ``1e-08`` as a text."""
    text = dump_case(load_case(dovetail_path))
    yaml = YAML(typ="safe", pure=True)
    yaml.version = (1, 1)
    assert isinstance(yaml.load(text)["wear"]["blade"]["coefficient"], float)


def test_dovetail_template_is_the_default_case(dovetail_path):
    written, default = parse_case(template("dovetail"), "dovetail"), load_case(dovetail_path)
    ours = {"assumed": default.assumed, "expect": default.expect}
    assert written.model_copy(update=ours) == default


@pytest.mark.parametrize("kind", kinds())
def test_template_reads_back_equal(kind, template_files):
    case = parse_case(template(kind), str(template_files / kind))
    assert isinstance(case, kinds()[kind])
    text = dump_case(case)
    assert parse_case(text, "dump") == case
    given = {name for name in kinds()[kind].model_fields if getattr(case, name) is not None}
    assert set(YAML(typ="safe").load(text)) == given


@pytest.mark.parametrize("kind", kinds())
def test_template_has_every_entry(kind):
    lines = [line.lstrip("# -").split(":")[0] for line in template(kind).splitlines()]

    def names(model):
        for name, field in model.model_fields.items():
            yield name
            for section in list(sections_of(field.annotation))[:1]:
                yield from names(section)

    assert set(names(kinds()[kind])) <= set(lines)
