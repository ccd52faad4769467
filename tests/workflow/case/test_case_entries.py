"""Every entry of a case refuses a wrong type, a wrong unit and a value out of range.

The entries are found by walking all kinds of case, so that a new one cannot be forgotten. An entry
that several sections inherit, or that appears in several places, is tested once, in the first of
its places.
"""

import math
from contextlib import suppress
from typing import Literal, get_origin

import pytest
from pydantic import BaseModel

from tests.workflow.case_leaves import (
    APART,
    APART_MATRICES,
    CAD,
    LEAVES,
    PLACES,
    SECTIONS,
    TEMPLATE,
    VARIANTS,
    declaring,
    each_section,
)
from workflow.case.fields import File, Formats, Path, Quantity, Text, Whole
from workflow.case.sections import entry_of
from workflow.errors import CaseError
from workflow.kinds import kinds, load_case, parse_case
from workflow.models.uncoupled.load_table import FORCES, MOTIONS


def load(leaf, folders, *overrides):
    """Load the template of the leaf's kind with the overrides that it needs and further ones."""
    path = folders[leaf.kind] / "case.yaml"
    return parse_case(TEMPLATE(leaf.kind), str(path), [*leaf.needed, *overrides])


def refused(leaf, folders, value):
    """Return the message that refuses ``value``: one line, which names the entry."""
    try:
        load(leaf, folders, f"{leaf.key}={value}")
    except CaseError as refusal:
        lines = str(refusal).splitlines()
        assert len(lines) == 1, f"{leaf}: {lines}"
        assert lines[0].startswith(f"--set {leaf.key}"), f"{leaf}: {lines[0]}"
        assert "allowed: " in lines[0], f"{leaf}: {lines[0]}"
        return lines[0]
    pytest.fail(f"{leaf}: takes {value}")


def test_every_declared_entry_is_tried_once():
    """Every declared entry is tested in exactly one of its places."""
    tried = [(leaf.declared, leaf.name) for entries in SECTIONS.values() for leaf in entries]
    assert len(set(tried)) == len(tried)
    assert set(tried) == {(leaf.declared, leaf.name) for leaf in PLACES}


@each_section
def test_wrong_type_is_refused(entries, folders):
    for leaf in entries:
        values = ["{a: 1}"]
        if isinstance(entry_of(leaf.field), Formats):
            values += ["3", "word", "[word]", "[]", "[png, png]"]
        elif leaf.is_list:
            values += ["3", "word", "true"]
        elif isinstance(entry_of(leaf.field), Quantity | Whole):
            values += ["true", "word", "'1'", ".nan", ".inf", "-.inf", "[1]"]
        elif isinstance(entry_of(leaf.field), Text | Path | File):
            values += ["3", "true", "' '", r'"a\nb"', "[a]"]
        elif leaf.field.annotation is bool:
            values += ["1", "yes", "[true]"]
        elif get_origin(leaf.field.annotation) is Literal:
            values += ["zzz"]
        for value in values:
            refused(leaf, folders, value)


def test_lists_hold_something_unless_they_may_be_empty(folders):
    empty = set()
    for leaf in LEAVES:
        if leaf.is_list:
            with suppress(CaseError):
                load(leaf, folders, f"{leaf.key}=[]")
                empty.add(leaf.key)
    assert empty == {
        *("assumed", "structure.loads.0.free", "structure.retained", "loops.harmonics"),
        *("force_sweeps", "at"),
    }


@each_section
def test_wrong_unit_is_refused(entries, folders):
    for leaf in entries:
        if not isinstance(entry_of(leaf.field), Quantity):
            continue
        wrong = leaf.listed("1", "{}") if leaf.is_list else "{}"
        assert "unknown unit" in refused(leaf, folders, wrong.format("1 furlongs_per_bushel"))
        if entry_of(leaf.field).unit is not None:
            assert "cannot be converted" in refused(leaf, folders, wrong.format("1 K^3/mol"))


def limits(leaf) -> list[float]:
    """Return the nearest values that are outside the limits of an entry."""
    entry = entry_of(leaf.field)
    if isinstance(entry, Whole):
        return [entry.at_least - 1, entry.at_most + 1]
    if not isinstance(entry, Quantity) or entry.unit is None:
        return []
    beyond = [
        *(entry.above, entry.below),
        *(math.nextafter(entry.at_least, -math.inf), math.nextafter(entry.at_most, math.inf)),
    ]
    beyond = [limit for limit in beyond if math.isfinite(limit)]
    assert len(beyond) >= 2, f"{leaf} needs two limits, or says nothing about its unit"
    return beyond


@each_section
def test_value_out_of_range_is_refused(entries, folders):
    for leaf in entries:
        entry = entry_of(leaf.field)
        for limit in limits(leaf):
            first = repr(entry.at_least if isinstance(entry, Whole) else 1.0)
            value = leaf.listed(first, repr(limit)) if leaf.is_list else repr(limit)
            refused(leaf, folders, value)


def test_entries_are_described():
    for leaf in LEAVES:
        assert leaf.field.description, leaf
        entry = entry_of(leaf.field)
        choice = leaf.field.annotation is bool or get_origin(leaf.field.annotation) is Literal
        assert choice or entry is not None, f"{leaf} has no limits: neither a choice nor an Entry"
        if isinstance(entry, Quantity) and entry.unit is not None:
            assert leaf.field.description.endswith(f"[{entry.unit}]"), leaf


# What an example asks for beside itself.
BESIDE = {f"structure.matrices.{part}": [APART] for part in APART_MATRICES} | {
    "structure.retained": ["structure.modes=20"],
    "structure.modes": ["structure.retained=[pad, tip]"],
    "joint.nodes": ["joint.area="],
    "measured.0.file": ["measured.0.at=[]", "measured.0.values=[]"],
}


def stated(leaf):
    """Return overrides that give an entry its example and remove the entries it replaces."""
    (example,) = leaf.field.examples
    example = str(example).lower() if isinstance(example, bool) else example
    plain = f"{leaf.key}={example}"
    match leaf.key:
        case "wear.step.depth" | "wear.step.volume" | "wear.step.fraction" if (
            leaf.kind != "specimens"
        ):
            return [f"wear.step={{kind: explicit, {leaf.name}: {example}}}"]
        case "wear.blade.specific_wear_rate":
            return [f"wear.blade={{law: archard, specific_wear_rate: {example}}}"]
        case "wear.reference_amplitude":
            return ["wear.law=energy_amplitude", plain]
        case "wear.energy" | "ageing.energy":
            return [leaf.key.replace("energy", "cycles="), plain]
        case "evolution.file":
            return [f"evolution={{file: {example}}}"]
        case "structure.body" | "structure.file" if example in (2, "specimens.yaml"):
            return ["structure.file=specimens.yaml", "structure.body=2"]
        case "load_path.file":
            return [f"load_path={{file: {example}}}"]
        case "mesh.size" if leaf.kind == "mesh":
            return [*CAD, plain]
    if leaf.name in MOTIONS:  # take the place of the forces
        force = {"P": 1.0} if leaf.name != "approach" else {}
        assert len(FORCES) == len(MOTIONS)
        return [f"load_path.legs={[force | {leaf.name: example}]}".replace("'", "")]
    return [*BESIDE.get(leaf.key, ()), plain]


@pytest.mark.usefixtures("reads_here")
@each_section
def test_example_is_accepted(entries, folders):
    for leaf in entries:
        case = load(leaf, folders, *stated(leaf))
        assert isinstance(case, kinds()[leaf.kind]), leaf
        node = case
        for key in leaf.key.split("."):
            node = node[int(key)] if key.isdecimal() else getattr(node, key)
        assert node is not None, leaf


def sections(node, path=(), place=()):
    """Yield path and place of every section: the entry that holds it, and its model."""
    if isinstance(node, BaseModel):
        yield path, (*place, type(node))
        for name in type(node).model_fields:
            place = (declaring(type(node), name), name)
            yield from sections(getattr(node, name), (*path, name), place)
    if isinstance(node, tuple):
        for index, item in enumerate(node):
            yield from sections(item, (*path, str(index)), place)


@pytest.mark.slow
def test_unknown_key_is_refused_in_every_section(folders):
    tried = set()
    for leaf in VARIANTS.values():
        for path, place in sections(load(leaf, folders)):
            if place in tried:
                continue
            tried.add(place)
            key = ".".join((*path, "zzz"))
            with pytest.raises(CaseError, match=rf"^--set {key}=1: unknown key; allowed: .*$"):
                load(leaf, folders, f"{key}=1")
    assert len(tried) > 100


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("structure.flank_angle=60 deg", math.pi / 3),
        ("structure.neck_width=1 inch", 25.4),
        ("structure.neck_width=2e4 µm", 20.0),
        ("load_path.rotation_speed=100 turn/s", 200 * math.pi),
        ("load_path.airfoil_mass=800 g", 8e-4),
        ("load_path.aerodynamic_moment=-2 N m", -2000.0),
        ("materials.blade.young=210e3", 210000.0),
        ("materials.disk.density=7.85 g/cm³", 7.85e-9),
        ("wear.blade.coefficient=1e-5 mm^3/(N*m)", 1e-8),
        ("coupling.drift=0.5 %", 0.005),
        ("wear.stop.depth=0.1 mm", 0.1),
    ],
)
def test_quantities_arrive_in_base_units(dovetail_path, override, value):
    node = load_case(dovetail_path, [override])
    for key in override.partition("=")[0].split("."):
        node = getattr(node, key)
    # An angle goes through decimals of pi, which may round the last bit otherwise.
    assert node == pytest.approx(value, rel=3e-16)


def test_sections_may_be_shared(dovetail_text):
    """YAML anchors let a section that is written once appear in two places."""
    shared = dovetail_text.replace("  blade: {young", "  blade: &titanium {young")
    start = shared.index("  disk: {young")
    shared = shared[:start] + "  disk: *titanium" + shared[shared.index("\n", start) :]
    assert parse_case(shared, "shared") == parse_case(dovetail_text, "plain")
