"""Every entry of a case refuses a wrong type, a wrong unit and a value out of range.

The entries are found by walking the kinds of case there are, so that a new one cannot be forgotten.
One that several sections inherit, or that stands in several places, is the same entry there: it is
tried once, in the first of its places.
"""

import functools
import inspect
import math
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path as Folder
from typing import Any, Literal, get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from fe_models.reduction import ReducedModel, save_reduced
from tests.conftest import CASES
from workflow.analyses.contact.load_table import FORCES, MOTIONS
from workflow.case import source
from workflow.case.fields import File, Path, Quantity, Text, Whole
from workflow.case.sections import Section, entry_of, sections_of
from workflow.errors import CaseError
from workflow.kinds import kinds, load_case, parse_case, template

BODY = ReducedModel(
    kept=np.arange(1),
    stiffness=np.eye(1),
    mass=np.eye(1),
    loads=np.zeros((1, 0)),
    mode_shapes=np.zeros((1, 0)),
    frequencies=np.zeros(0),
    names=("pad 1 x",),
)
LENGTHS = {"cycles": 1e5, "step": {"kind": "implicit", "cycles": 5000}}
ARCHARD_BODY = {"coefficient": 1e-4, "hardness": "3.5 GPa"}
ENERGY_BODY = {"coefficient": "1e4 um^3/J"}
ROUNDED = {"shape": "rounded", "edge_width": 1, "edge_radius": 30, "end_width": 1, "end_radius": 30}
GAPS = {
    "paraboloid": {"shape": "paraboloid", "radius_x": "1 m", "radius_y": "1 m"},
    "heights": {"shape": "heights", "file": "gap.npy"},
}
INTERFACE = {
    "name": "interface",
    "size": [11, 60],
    "gap": ROUNDED,
    "frame": {"origin": [15, 0, 245], "x": [-1, 0, 1], "normal": [-1, 0, -1]},
    "nodes": {"body_1": "nodes_1.csv", "body_2": "nodes_2.csv"},
}
EXPECT = [
    {"quantity": "a.b", "value": "3 um", "tolerance": "1 %", "kind": "earlier", "source": "a test"}
]
REPORTED = [{"normal_force": "17 N", "steady": "stiffness", "cycles": 1e6}]
ALWAYS = ""  # in place of a kind: for sections of one kind alone
FRICTION = {"friction.evolution": {ALWAYS: {"energy": [0, 1e6], "factor": [1, 2]}}}
EVOLUTIONS = {
    "local": {"scope": "local", "energy": [0, 1000], "factor": [1, 2], "threshold": 10},
    "global": {"scope": "global", "energy": [0, 1e6], "factor": [1, 2], "threshold": 1e4},
}


def laws(lengths, *bodies):
    """The laws and evolutions that the templates do not have, for bodies of these names."""
    by_law = {
        "archard": {"law": "archard", **lengths, **dict.fromkeys(bodies, ARCHARD_BODY)},
        "energy_amplitude": {
            "law": "energy_amplitude",
            "reference_amplitude": "75 um",
            **lengths,
            **dict.fromkeys(bodies, ENERGY_BODY),
        },
    }
    return {"wear": by_law} | {f"wear.{body}.evolution": EVOLUTIONS for body in bodies}


def wear(*bodies):
    """The same of wear cases, whose friction may change too."""
    return FRICTION | laws(LENGTHS, *bodies)


def with_path(**loads):
    """Loads of a mesh by kind, each pulled once and let go."""
    return {kind: {"kind": kind, "path": [1, 0], **load} for kind, load in loads.items()}


# Sections that the templates do not have: kind of case, key of the section, its own kinds.
GIVEN = {
    "dovetail": {"load_path.mix": {ALWAYS: [{"share": 1}]}, **wear("blade", "disk")},
    "mesh": {
        "load_path.mix": {ALWAYS: [{"share": 1, "factors": [1]}]},
        "structure.contacts.0.gap": GAPS,
        "structure.loads.0": with_path(
            force={"group": "blade_top", "force": [0, 0, -100]},
            displacement={"group": "blade_top", "displacement": [0.01, 0, 0]},
            rotation={"axis": [0, 1, 0], "through": [0, 0, 0], "speed": "6000 rpm"},
            acceleration={"acceleration": [0, 0, 9810]},
        ),
        **wear("body_1", "body_2"),
    },
    "resultants": {
        "structure.gap": GAPS,
        "structure.interfaces": {
            **{shape: [{**INTERFACE, "gap": gap}] for shape, gap in GAPS.items()},
            ALWAYS: [INTERFACE],
        },
        **wear("body_1", "body_2"),
    },
    "specimens": {
        "structure.form": {ALWAYS: {"along": "1 m", "across": "50 mm"}},
        "wear.reported": {ALWAYS: REPORTED},
        **laws({"cycles": 1e5}, "body_1", "body_2"),
    },
    "bodies": {
        "structure": {
            "ellipsoid": {"kind": "bodies", "shape": "ellipsoid", "radius_x": 1, "radius_y": 2},
            "heights": {"kind": "bodies", "shape": "heights", "file": "gap.npy"},
        }
    },
    "line": {
        "structure": {
            "flat_rounded": {
                "kind": "bodies",
                "shape": "flat_rounded",
                "half_width": 1,
                "edge_radius": 2,
            },
            "heights": {"kind": "bodies", "shape": "heights", "file": "gap.npy"},
        }
    },
}
FLAT = {"kind": "bodies", "shape": "flat", "half_width": 0.1, "step": 0.1}
FLATS = {"bodies": FLAT | {"half_length": 0.1}, "line": FLAT}
# Two bodies that wear may have the shapes of those that do not, or be flat.
GIVEN |= {
    f"{kind}_wear": wear("body_1", "body_2")
    | {"structure": GIVEN[kind]["structure"] | {"flat": flat}}
    for kind, flat in FLATS.items()
}
# Cases in time: other joints, factors of their parameters, and other excitations.
JOINT = {"normal_load": 60, "friction": 0.1, "stiffness": 1e4}
JOINTS = {law: {"law": law, **JOINT} for law in ("jenkins", "uniform_iwan", "four_parameter_iwan")}
TOLD = [{"quantity": "a.b", "value": "3 um", "source": "a test"}]
JOINTS["four_parameter_iwan"] |= {"chi": -0.5, "beta": 1.0}
FACTORS = {
    "logarithmic": {"kind": "logarithmic", "change": 0.1, "rate": 1},
    "arrhenius": {"kind": "arrhenius", "change": 0.1, "scale": 1},
    "linear": {"kind": "linear", "slope": 0},
    "exponential": {"kind": "exponential", "final": 1, "rate": 1},
    "table": {"kind": "table", "energy": [0, 1000], "factor": [1, 1]},
}
EVOLUTION = {
    f"evolution.{name}": FACTORS
    for name in ("friction", "stiffness", "residual_stiffness", "normal_load")
}
GIVEN["joint"] = {"joint": JOINTS, **EVOLUTION, "reported": {ALWAYS: TOLD}}
GIVEN["vibration_wear"] = GIVEN["friction_rig_wear"] = {}
CONTACT = {"law": "friction_contact", **JOINT, "normal_load": 0, "normal_stiffness": 1e4}
REDUCED = {
    "kind": "reduced",
    "file": "body_2.h5",
    "joints": [{"points": "pad", "direction": "-z"}],
    "masses": [{"points": "ring", "mass": 1}],
    "springs": [{"points": "ring", "direction": "x", "stiffness": 1}],
    "damping_ratio": 0.1,
    "driven": {"points": "ring", "direction": "x"},
    "seen": {"points": "pad", "direction": "x"},
}
FRICTION_RIG = {
    "kind": "friction_rig",
    "specimens": "specimens_rig.yaml",
    "masses": [1, 1],
    "springs": [1, 1],
    "damping_ratio": 0.1,
}
GIVEN["vibration"] = {
    "structure": {"reduced": REDUCED, "friction_rig": FRICTION_RIG},
    "joint": JOINTS | {"friction_contact": CONTACT},
    "loops": {ALWAYS: {"frequency": "100 Hz"}},
}
GIVEN["rig"] = GIVEN["joint"] | {
    "structure": {"reduced": REDUCED},
    "joint": JOINTS | {"friction_contact": CONTACT},
    "ageing": {ALWAYS: {"cycles": 1000}},
    "excitation": {
        "hammer": {
            "kind": "hammer",
            "force": 1,
            "duration": 4e-4,
            "record": 1,
            "band": [1, 500],
        },
        "recorded": {"kind": "recorded", "file": "force.csv"},
    },
}
# A CAD file in the place of the template's mesh; gmsh writes no names into it.
CAD = [
    "structure.file=joint.step",
    "structure.body_1=solid_1",
    "structure.body_2=solid_2",
    "structure.contacts.0.face_1=solid_1.face_6",
    "structure.contacts.0.face_2=solid_2.face_5",
    "structure.supports.0.group=solid_1.face_5",
    "structure.loads.0.group=solid_2.face_6",
]
# Cells of the templates that may take heights.
CELLS = {"mesh": (128, 256), "resultants": (128, 256)}
CELLS |= dict.fromkeys(("bodies", "bodies_wear"), (128, 128))
CELLS |= dict.fromkeys(("line", "line_wear"), (512,))


@dataclass(frozen=True)
class Leaf:
    """An entry in one of its places: a kind of case, a dotted key there, the kinds of sections.

    ``declared`` is the section that declares it, be it for those that inherit from it.
    """

    kind: str
    key: str
    tags: tuple[str, ...]
    field: Any
    declared: type[Section]

    def __str__(self) -> str:
        return ":".join((self.kind, self.key, *self.tags))

    @property
    def name(self) -> str:
        return self.key.rpartition(".")[2]

    @property
    def needed(self) -> list[str]:
        """Overrides that make the template have it."""
        overrides = []
        for section, given in ({"expect": {ALWAYS: EXPECT}} | GIVEN.get(self.kind, {})).items():
            if self.key.startswith(f"{section}."):
                chosen = [given[tag] for tag in (*self.tags, ALWAYS) if tag in given]
                overrides += [f"{section}={value}" for value in chosen[:1]]
        if "friction_contact" in self.tags:
            overrides.append(f"structure={REDUCED}")
        if "friction_rig" in self.tags:
            overrides.append(f"joint={CONTACT | {'normal_load': 60}}")
        return overrides

    @property
    def is_list(self) -> bool:
        return "tuple" in str(self.field.annotation)

    def listed(self, first, last):
        """A list as long as the example, its last value another than those before."""
        return f"[{', '.join([first] * (len(self.field.examples[0]) - 1) + [last])}]"


def declaring(model: type[Section], name: str) -> type[Section]:
    """The section that declares an entry which ``model`` has or inherits."""
    return next(base for base in model.__mro__ if name in inspect.get_annotations(base))


def leaves(model, path=(), tags=()):
    """``(path, tags, field, declaring section)`` of every leaf, in every place.

    Lists are entered at 0, unions at all their kinds.
    """
    for name, field in model.model_fields.items():
        sections = list(sections_of(field.annotation))
        index = (0,) if get_origin(field.annotation) is tuple and sections else ()
        for section in sections:
            choices = [section.model_fields[key] for key in ("law", "shape", "kind", "scope")
                       if key in section.model_fields and len(sections) > 1]  # fmt: skip
            tag = [get_args(choice.annotation)[0] for choice in choices[:1]]
            yield from leaves(section, (*path, name, *index), (*tags, *tag))
        if not sections:
            yield (*path, name), tags, field, declaring(model, name)


def in_all_places() -> Iterator[Leaf]:
    for kind, model in kinds().items():
        for path, tags, field, declared in leaves(model):
            yield Leaf(kind, ".".join(map(str, path)), tags, field, declared)


def first_of_each(places: list[Leaf]) -> list[Leaf]:
    """Every declared entry, in the first of its places."""
    first: dict[tuple[type[Section], str], Leaf] = {}
    for leaf in places:
        first.setdefault((leaf.declared, leaf.name), leaf)
    return list(first.values())


PARSED = functools.cache(source.parse_yaml)
TEMPLATE = functools.cache(template)
PLACES = list(in_all_places())
LEAVES = first_of_each(PLACES)
SECTIONS: dict[type[Section], list[Leaf]] = {}
for _leaf in LEAVES:
    SECTIONS.setdefault(_leaf.declared, []).append(_leaf)
each_section = pytest.mark.parametrize(
    "entries", SECTIONS.values(), ids=[section.__name__ for section in SECTIONS]
)
# Every set of sections that some entry needs.
VARIANTS = {(leaf.kind, *leaf.needed): leaf for leaf in PLACES}


@pytest.fixture(autouse=True)
def _parse_once(monkeypatch):
    """Reading the same YAML a thousand times would take most of the time of these tests."""
    monkeypatch.setattr(source, "parse_yaml", PARSED)


@pytest.fixture(scope="module")
def folders(tmp_path_factory, template_files) -> dict[str, Folder]:
    """A folder for the template of each kind, with the files that its examples name."""
    made = {}
    for kind in kinds():
        made[kind] = tmp_path_factory.mktemp(kind)
        shutil.copytree(template_files, made[kind], dirs_exist_ok=True)
        np.save(made[kind] / "gap.npy", np.zeros(CELLS.get(kind, (0, 0))))
        (made[kind] / "history.csv").write_text("P,Qx\n1,0\n1,0.1\n", encoding="utf-8")
        (made[kind] / "force.csv").write_text("time,force\n0,0\n1,5\n", encoding="utf-8")
        shutil.copy(CASES / "specimens_coarse.yaml", made[kind] / "specimens.yaml")
        save_reduced(made[kind] / "body_2.h5", BODY)
        (made[kind] / "loops.csv").write_text("energy,P,kt,mu\n0,1,1,1\n", encoding="utf-8")
    return made


def load(leaf, folders, *overrides):
    """The template of the leaf's kind with the overrides that it needs and more."""
    path = folders[leaf.kind] / "case.yaml"
    return parse_case(TEMPLATE(leaf.kind), str(path), [*leaf.needed, *overrides])


def refused(leaf, folders, value):
    """The message that refuses ``value``: one line, which names the entry."""
    try:
        load(leaf, folders, f"{leaf.key}={value}")
    except CaseError as refusal:
        lines = str(refusal).splitlines()
        assert len(lines) == 1, f"{leaf}: {lines}"
        assert lines[0].startswith(f"--set {leaf.key}"), f"{leaf}: {lines[0]}"
        assert "allowed: " in lines[0], f"{leaf}: {lines[0]}"
        return lines[0]
    pytest.fail(f"{leaf}: takes {value}")


def test_walk_finds_the_leaves():
    keys = {leaf.key for leaf in PLACES}
    assert {"wear.blade.hardness", "wear.reference_amplitude", "expect.0.tolerance"} <= keys
    assert {"load_path.legs.0.approach", "structure.radius_y", "contact.datum"} <= keys
    assert {"structure.contacts.0.gap.file", "structure.loads.0.speed"} <= keys
    assert {"wear.reported.0.steady", "structure.form.across", "nonlinearity.check"} <= keys
    assert len(set(map(str, PLACES))) == len(PLACES) > 1000
    assert len(set(map(str, LEAVES))) == len(LEAVES) > 350


def test_every_declared_entry_is_tried_once():
    """Whatever place an entry stands in: none is left out, and none is tried again elsewhere."""
    tried = [(leaf.declared, leaf.name) for entries in SECTIONS.values() for leaf in entries]
    assert len(set(tried)) == len(tried)
    assert set(tried) == {(leaf.declared, leaf.name) for leaf in PLACES}


@each_section
def test_wrong_type_is_refused(entries, folders):
    for leaf in entries:
        values = ["{a: 1}"]
        if leaf.is_list:
            values += ["3", "word", "true"]
        elif isinstance(entry_of(leaf.field), Quantity | Whole):
            values += ["true", "word", "'1'", ".nan", ".inf", "-.inf", "[1]"]
        elif isinstance(entry_of(leaf.field), Text | Path | File):
            values += ["3", "true", "' '", r'"a\nb"', "[a]"]
        elif leaf.field.annotation is bool:
            values += ["1", "yes", "[true]"]
        for value in values:
            refused(leaf, folders, value)


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
    """The nearest values that are no longer within the limits of an entry."""
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


def stated(leaf):
    """Overrides that give an entry its example; what it takes the place of goes."""
    (example,) = leaf.field.examples
    example = str(example).lower() if isinstance(example, bool) else example
    plain = f"{leaf.key}={example}"
    match leaf.key:
        case "wear.step.depth" | "wear.step.volume" | "wear.step.fraction" if (
            leaf.kind != "specimens"
        ):
            return [f"wear.step={{kind: explicit, {leaf.name}: {example}}}"]
        case "wear.reference_amplitude":
            return ["wear.law=energy_amplitude", plain]
        case "wear.energy":
            return ["wear.cycles=", plain]
        case "ageing.energy":
            return ["ageing.cycles=", plain]
        case "evolution.file":
            return [f"evolution={{file: {example}}}"]
        case "structure.body":
            return ["structure.file=specimens.yaml", plain]
        case "load_path.file":
            return [f"load_path={{file: {example}}}"]
        case "structure.size" if leaf.kind == "mesh":
            return [*CAD, plain]
    if leaf.name in MOTIONS:  # take the place of the forces
        force = {"P": 1.0} if leaf.name != "approach" else {}
        assert len(FORCES) == len(MOTIONS)
        return [f"load_path.legs={[force | {leaf.name: example}]}".replace("'", "")]
    return [plain]


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
    """Path and place of every section: the entry that holds it, and its model."""
    if isinstance(node, BaseModel):
        yield path, (*place, type(node))
        for name in type(node).model_fields:
            place = (declaring(type(node), name), name)
            yield from sections(getattr(node, name), (*path, name), place)
    if isinstance(node, tuple):
        for index, item in enumerate(node):
            yield from sections(item, (*path, str(index)), place)


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
