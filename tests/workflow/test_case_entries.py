"""Every entry of a case refuses a wrong type, a wrong unit and a value out of range.

The entries are found by walking the schema, so that a new one cannot be forgotten.
"""

import functools
import math
from typing import get_args

import pytest
from pydantic import BaseModel

from workflow.case import CaseError, load_case, parse_case, source
from workflow.case.fields import Path, Quantity, Text, Whole
from workflow.case.schema import Case, entry_of, sections_of

ARCHARD = {
    "law": "archard",
    "cycles": 1e5,
    "step": {"kind": "implicit", "cycles": 5000},
    "blade": {"coefficient": 1e-4, "hardness": "3.5 GPa"},
    "disk": {"coefficient": 1e-4, "hardness": "3.5 GPa"},
}
AMPLITUDE = {
    **ARCHARD,
    "law": "energy_amplitude",
    "reference_amplitude": "75 um",
    "blade": {"coefficient": "1e4 um^3/J"},
    "disk": {"coefficient": "1e4 um^3/J"},
}
EXPECT = [{"quantity": "a.b", "value": "3 um", "tolerance": "1 %", "source": "a test"}]
# Sections that the default case does not have, by the law they need.
WITH = {
    "energy": [f"expect={EXPECT}", "wear.stop={depth: 1 mm, volume: 1 mm^3}"],
    "energy_amplitude": [f"wear={AMPLITUDE}"],
    "archard": [f"wear={ARCHARD}"],
}


def leaves(model, path=()):
    """``(path, field)`` of every leaf; list entries and unions are entered."""
    for name, field in model.model_fields.items():
        sections = list(sections_of(field.annotation))
        index = (0,) if field.default == () and sections else ()
        for section in sections:
            kind = section.model_fields.get("law")
            tag = get_args(kind.annotation) if kind else ()
            yield from leaves(section, (*path, name, *index, *tag))
        if not sections:
            yield (*path, name), field


PARSED = functools.cache(source.parse_yaml)
LEAVES = list(leaves(Case))
QUANTITIES = [(path, f) for path, f in LEAVES if isinstance(entry_of(f), Quantity)]


@pytest.fixture(autouse=True)
def _parse_once(monkeypatch):
    """Reading the same YAML a thousand times would take most of the time of these tests."""
    monkeypatch.setattr(source, "parse_yaml", PARSED)


def names(rows):
    return [".".join(map(str, path)) for path, _ in rows]


def place(path):
    """Dotted key, and the overrides that make the case have it."""
    laws = [law for law in WITH if law in path and "wear" in path]
    key = ".".join(str(part) for part in path if part not in laws)
    return key, WITH[laws[0] if laws else "energy"]


def refused(path, dovetail_path, value):
    """The message that refuses ``value``: one line, which names the entry."""
    key, needed = place(path)
    with pytest.raises(CaseError) as refusal:
        load_case(dovetail_path, [*needed, f"{key}={value}"])
    (line,) = str(refusal.value).splitlines()
    assert line.startswith(f"--set {key}"), line
    assert "allowed: " in line, line
    return line


def test_walk_finds_the_leaves():
    found = {place(path)[0] for path, _ in LEAVES}
    assert {"wear.blade.hardness", "wear.reference_amplitude", "expect.0.tolerance"} <= found
    assert len(LEAVES) > 60


@pytest.mark.parametrize(("path", "field"), LEAVES, ids=names(LEAVES))
def test_wrong_type_is_refused(path, field, dovetail_path):
    values = ["{a: 1}"]
    if "tuple" in str(field.annotation):
        values += ["3", "word", "true"]
    elif isinstance(entry_of(field), Quantity | Whole):
        values += ["true", "word", "'1'", ".nan", ".inf", "-.inf", "[1]"]
    elif isinstance(entry_of(field), Text | Path):
        values += ["3", "true", "' '", r'"a\nb"', "[a]"]
    elif field.annotation is bool:
        values += ["1", "yes", "[true]"]
    for value in values:
        refused(path, dovetail_path, value)


@pytest.mark.parametrize(("path", "field"), QUANTITIES, ids=names(QUANTITIES))
def test_wrong_unit_is_refused(path, field, dovetail_path):
    assert "unknown unit" in refused(path, dovetail_path, "1 furlongs_per_bushel")
    if entry_of(field).unit is not None:
        assert "cannot be converted" in refused(path, dovetail_path, "1 K^3/mol")


@pytest.mark.parametrize(("path", "field"), LEAVES, ids=names(LEAVES))
def test_value_out_of_range_is_refused(path, field, dovetail_path):
    entry = entry_of(field)
    limits = []
    if isinstance(entry, Whole):
        limits = [entry.at_least - 1, entry.at_most + 1]
        if "tuple" in str(field.annotation):
            limits = [[entry.at_least, limit] for limit in limits]
    if isinstance(entry, Quantity) and entry.unit is not None:
        limits = [
            *(entry.above, entry.below),
            *(math.nextafter(entry.at_least, -math.inf), math.nextafter(entry.at_most, math.inf)),
        ]
        limits = [limit for limit in limits if math.isfinite(limit)]
        assert len(limits) >= 2, "a quantity needs two limits, or says nothing about its unit"
    for limit in limits:
        refused(path, dovetail_path, repr(limit))


@pytest.mark.parametrize(("path", "field"), LEAVES, ids=names(LEAVES))
def test_entry_is_described(path, field):
    assert field.description
    entry = entry_of(field)
    if isinstance(entry, Quantity) and entry.unit is not None:
        assert field.description.endswith(f"[{entry.unit}]")


@pytest.mark.parametrize(("path", "field"), LEAVES, ids=names(LEAVES))
def test_example_is_accepted(path, field, dovetail_path):
    (example,) = field.examples
    key, needed = place(path)
    if key in ("wear.step.depth", "wear.step.volume"):  # take the place of the cycles
        key, example = "wear.step", f"{{kind: explicit, {path[-1]}: {example}}}"
    example = str(example).lower() if isinstance(example, bool) else example
    load_case(dovetail_path, [*needed, f"{key}={example}"])


@pytest.mark.parametrize("law", WITH)
def test_unknown_key_is_refused_in_every_section(law, dovetail_path):
    case = load_case(dovetail_path, WITH[law])

    def sections(node, path=()):
        if isinstance(node, BaseModel):
            yield path
            for name in type(node).model_fields:
                yield from sections(getattr(node, name), (*path, name))
        if isinstance(node, tuple):
            for index, item in enumerate(node):
                yield from sections(item, (*path, str(index)))

    for path in sections(case):
        key = ".".join((*path, "zzz"))
        with pytest.raises(CaseError, match=f"--set {key}=1: unknown key; allowed: "):
            load_case(dovetail_path, [*WITH[law], f"{key}=1"])


@pytest.mark.parametrize(
    ("override", "path", "value"),
    [
        ("structure.flank_angle=0.7", "structure.flank_angle", 0.7),
        ("structure.flank_angle=60 deg", "structure.flank_angle", math.pi / 3),
        ("structure.flank_angle=60°", "structure.flank_angle", math.pi / 3),
        ("structure.neck_width=1 inch", "structure.neck_width", 25.4),
        ("structure.neck_width=.02m", "structure.neck_width", 20.0),
        ("structure.neck_width=2e4 µm", "structure.neck_width", 20.0),
        ("load_path.rotation_speed=100 turn/s", "load_path.rotation_speed", 200 * math.pi),
        ("load_path.airfoil_mass=800 g", "load_path.airfoil_mass", 8e-4),
        ("load_path.aerodynamic_moment=-2 N m", "load_path.aerodynamic_moment", -2000.0),
        ("materials.blade.young=210e3", "materials.blade.young", 210000.0),
        ("materials.disk.density=7.85 g/cm³", "materials.disk.density", 7.85e-9),
        ("wear.blade.coefficient=1e-5 mm^3/(N*m)", "wear.blade.coefficient", 1e-8),
        ("wear.cycles=1e5", "wear.cycles", 1e5),
        ("contact.tolerance=1e-6", "contact.tolerance", 1e-6),
        ("coupling.drift=0.5 %", "coupling.drift", 0.005),
        ("contact.grid.0=64", "contact.grid", (64, 256)),
        ("wear.stop.depth=0.1 mm", "wear.stop.depth", 0.1),
        ("materials.blade.yield_stress=", "materials.blade.yield_stress", None),
        ("assumed=[wear.blade.coefficient, mesh.flank_nodes.1]", "assumed",
         ("wear.blade.coefficient", "mesh.flank_nodes.1")),
    ],
)  # fmt: skip
def test_quantities_arrive_in_base_units(dovetail_path, override, path, value):
    node = load_case(dovetail_path, [override])
    for key in path.split("."):
        node = getattr(node, key)
    # An angle goes through decimals of pi, which may round the last bit otherwise.
    assert node == (pytest.approx(value, rel=3e-16) if isinstance(value, float) else value)
    assert type(node) is type(value)


def test_any_dimension_goes_to_base_units(dovetail_path):
    """N, mm, s, tonne are coherent: a work of 1 J is 1000 N mm, a power of 1 W is 1000 N mm/s."""
    for text, value in (("1 J", 1e3), ("1 W", 1e3), ("2 GPa", 2e3), ("1 kg", 1e-3), ("3 um", 3e-3)):
        expect = [{**EXPECT[0], "value": text}]
        assert load_case(dovetail_path, [f"expect={expect}"]).expect[0].value == value


def test_no_yield_stress_is_an_infinite_one(dovetail_path):
    case = load_case(dovetail_path, ["materials.blade.yield_stress="])
    assert case.materials.blade.elastic().yield_stress == math.inf
    assert case.materials.disk.elastic().yield_stress == 900.0


def test_case_is_frozen(dovetail_path):
    case = load_case(dovetail_path)
    with pytest.raises(ValueError, match="frozen"):
        case.friction.coefficient = 0.1


def test_sections_may_be_shared(dovetail_text):
    """YAML's anchors: what is written once may stand in two places."""
    shared = dovetail_text.replace("  blade: {young", "  blade: &titanium {young")
    start = shared.index("  disk: {young")
    shared = shared[:start] + "  disk: *titanium" + shared[shared.index("\n", start) :]
    assert parse_case(shared, "shared") == parse_case(dovetail_text, "plain")
