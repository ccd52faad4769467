"""Walk over every entry of every kind of case, with the settings that the templates lack."""

import functools
import inspect
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_args, get_origin

import numpy as np
import pytest

from fe_models.joints.reduction import ReducedModel
from workflow.case.sections import Section, sections_of
from workflow.kinds import kinds, template


def row_in_space(points):
    """Return springs of stiffness 1 between points in a free row, equal along all three axes."""
    stretch = np.eye(points - 1, points, k=1) - np.eye(points - 1, points)
    return np.kron(np.eye(3), stretch.T @ stretch)


BODY = ReducedModel(
    *(np.arange(12), 1e3 * row_in_space(4), 1e-3 * np.eye(12)),
    *(np.zeros((12, 0)), np.zeros((12, 0)), np.zeros(0)),
    names=tuple(f"{p} {axis}" for axis in "xyz" for p in ("pad 1", "pad 2", "ring 1", "ring 2")),
)
LENGTHS = {"cycles": 1e5, "step": {"kind": "implicit", "cycles": 5000}}
ARCHARD_BODY = {"coefficient": 1e-4, "hardness": "3.5 GPa"}
ENERGY_BODY = {"coefficient": "1e4 um^3/J"}
ROUNDED = {"shape": "rounded", "edge_width": 1, "edge_radius": 30, "end_width": 1, "end_radius": 30}
GAPS = {
    "paraboloid": {"shape": "paraboloid", "radius_x": "1 m", "radius_y": "1 m"},
    "heights": {"shape": "heights", "file": "gap.npy"},
}
SURFACE = {"file": "disk.npy", "unit": "um", "pitch": ["20 um", "20 um"]}
SURFACES = {"body_1": SURFACE, "body_2": SURFACE}
# Points whose spacing lets a scan cover the whole flank.
ON_FLANK = SURFACE | {"pitch": [0.1, 0.2], "beyond": "mirrored"}
FLANK_SURFACES = {
    flank: {"disk": ON_FLANK, "blade": ON_FLANK} for flank in ("intrados", "extrados")
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
MEASURED = [{"curve": "depth", "at": [1, 2], "values": [1, 2], "source": "a test"}]
REPORTED = [{"normal_force": "17 N", "steady": "stiffness", "cycles": 1e6}]
ALWAYS = ""  # in place of a kind: for sections of one kind alone
PLAIN = {"measured": {ALWAYS: MEASURED}, "expect": {ALWAYS: EXPECT}}  # of all kinds
FRICTION = {"friction.evolution": {ALWAYS: {"energy": [0, 1e6], "factor": [1, 2]}}}
EVOLUTIONS = {
    "local": {"scope": "local", "energy": [0, 1000], "factor": [1, 2], "threshold": 10},
    "global": {"scope": "global", "energy": [0, 1e6], "factor": [1, 2], "threshold": 1e4},
}


def laws(lengths, *bodies):
    """Return the joint laws and evolutions that the templates lack, for bodies of these names."""
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
    """Return the same for wear cases, whose friction may change as well."""
    return FRICTION | laws(LENGTHS, *bodies)


def with_path(**loads):
    """Return the loads of a mesh by kind, each applied once and released."""
    return {kind: {"kind": kind, "path": [1, 0], **load} for kind, load in loads.items()}


BY_ENERGY = {"law": "energy", "body_1": ENERGY_BODY, "body_2": ENERGY_BODY}
# A third body on the two of the template's mesh.
BOLT = [{"name": "bolt", "material": {"young": "200 GPa", "poisson": 0.3, "density": 7.8e-9}}]
BOLTED = [
    {"name": "pad", "face_1": "disk_top", "face_2": "blade_foot", "x": [1, 0, 0]},
    {
        "name": "bolted",
        "bodies": ["blade", "bolt"],
        "face_1": "blade_top",
        "face_2": "bolt_foot",
        "x": [1, 0, 0],
    },
]
SHANK = {"name": "bolt", "body": "blade", "through": [0, 0, 2], "axis": [0, 0, 1]}
# Sections that the templates do not have: kind of case, key of the section, its own kinds.
GIVEN = {
    "dovetail": {
        "structure.surfaces": {ALWAYS: FLANK_SURFACES},
        "load_path.mix": {ALWAYS: [{"share": 1}]},
        **wear("blade", "disk"),
    },
    "mesh": {
        "load_path.mix": {ALWAYS: [{"share": 1, "factors": [1]}]},
        "structure.contacts.0.gap": GAPS,
        "structure.contacts.0.surfaces": {ALWAYS: SURFACES},
        "structure.contacts.0.friction": {ALWAYS: {"coefficient": 0.4}},
        **{
            f"structure.contacts.0.{section}": given
            | ({ALWAYS: BY_ENERGY} if section == "wear" else {})
            for section, given in laws({}, "body_1", "body_2").items()
        },
        "structure.other_bodies": {ALWAYS: BOLT},
        "structure.cyclic": {ALWAYS: [{"low": "disk_low", "high": "disk_high", "sectors": 24}]},
        "structure.loads.0": with_path(
            force={"group": "blade_top", "force": [0, 0, -100]},
            displacement={"group": "blade_top", "displacement": [0.01, 0, 0]},
            rotation={"axis": [0, 1, 0], "through": [0, 0, 0], "speed": "6000 rpm"},
            acceleration={"acceleration": [0, 0, 9810]},
            pretension=SHANK | {"force": "10 kN"},
            shortening=SHANK | {"shortening": "20 um"},
            moment={"group": "blade_top", "moment": [0, 5, 0]},
            remote_displacement={
                "group": "blade_top",
                "at": [0, 0, 50],
                "displacement": [0.01, 0, 0],
            },
            temperature={"change": 100},
            nodal_temperature={"file": "temperatures.csv", "reference": 20},
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
        "structure.surfaces": {ALWAYS: SURFACES},
        "wear.reported": {ALWAYS: REPORTED},
        **laws({"cycles": 1e5}, "body_1", "body_2"),
    },
    "bodies": {
        "structure": {
            "ellipsoid": {"kind": "bodies", "shape": "ellipsoid", "radius_x": 1, "radius_y": 2},
            "heights": {"kind": "bodies", "shape": "heights", "file": "gap.npy"},
            "plane": {"kind": "bodies", "shape": "plane", "surfaces": SURFACES},
        },
        "structure.surfaces": {ALWAYS: SURFACES},
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
            "plane": {"kind": "bodies", "shape": "plane", "surfaces": SURFACES},
        },
        "structure.surfaces": {ALWAYS: SURFACES},
    },
}
FLAT = {"kind": "bodies", "shape": "flat", "half_width": 0.1, "step": 0.1}
FLATS = {"bodies": FLAT | {"half_length": 0.1}, "line": FLAT}
LEGS = {"legs": {"legs": [{"P": 5}, {"P": 6}]}}
# Two bodies that wear may have the shapes of those that do not, or be flat; legs or a stroke.
GIVEN |= {
    f"{kind}_wear": wear("body_1", "body_2")
    | GIVEN[kind]
    | {"structure": GIVEN[kind]["structure"] | {"flat": flat}, "load_path": LEGS}
    for kind, flat in FLATS.items()
}
# Bodies that do not wear may have layers.
LAYERS = [{"thickness": "50 um", "young": "50 GPa", "poisson": 0.3}]
for kind in FLATS:
    GIVEN[kind]["materials.body_1.layers"] = {ALWAYS: LAYERS}
    GIVEN[kind]["friction.by_pressure"] = {ALWAYS: {"pressure": [0, 1000], "factor": [1, 0.6]}}
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
DAMPING = {
    "structure.damping.rayleigh": {
        "factors": {"kind": "factors", "mass_factor": 1, "stiffness_factor": 1},
        "ratios": {"kind": "ratios", "frequencies": [0.5, 2], "ratios": [0.5, 0.5]},
    },
    "structure.damping.dashpots": {
        ALWAYS: [{"points": "m1", "coefficient": 1}],
        **{
            kind: [{"points": "pad", "coefficient": 1}]
            for kind in ("reduced", "matrices", "points")
        },
    },
}


def excited(point):
    """Return what replaces the forces of the template, including the one that wears."""
    return {
        "excitation": {ALWAYS: {"forces": [{"points": point, "amplitude": 1}]}},
        "excitation.records": {ALWAYS: [{"points": point, "file": "period.csv"}]},
        "excitation.base": {
            kind: [{"kind": kind, "amplitude": 1}] for kind in ("displacement", "acceleration")
        },
    }


EXCITED = excited("m1")
WORN_SO = ["forces=", "wear.force=", "wear.level=1"]
SHAKEN = {
    "vibration": ["forces="],
    "vibration_wear": WORN_SO,
    "friction_rig_wear": WORN_SO,
    "reduced_wear": ["structure.driven=", *WORN_SO],
}
GIVEN["vibration_wear"] = GIVEN["friction_rig_wear"] = DAMPING | EXCITED
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
MATRICES = {
    **{name: value for name, value in REDUCED.items() if name != "file"},
    "kind": "matrices",
    "matrices": {"file": "matrices.npz", "units": {"length": "mm", "force": "N"}},
    "masses": [{"points": "tip", "mass": 1}],
    "springs": [{"points": "tip", "direction": "x", "stiffness": 1}],
    "driven": {"points": "tip", "direction": "x"},
}
POINTS = {
    **{name: value for name, value in REDUCED.items() if name != "file"},
    "kind": "points",
    "points": [{"name": name, "mass": 1} for name in ("pad", "ring", "left", "right")],
    "directions": "xyz",
}
FACES = [{"points": "right", "next_points": "left"}]
FRICTION_RIG = {
    "kind": "friction_rig",
    "specimens": "specimens_rig.yaml",
    "masses": [1, 1],
    "springs": [1, 1],
    "damping_ratio": 0.1,
}
ELASTIC = {
    "polynomial_spring": {"law": "polynomial_spring", "stiffness": "1 N/um"},
    "elastic_stop": {"law": "elastic_stop", "stiffness": "10 N/um"},
}
# Joints in a row of masses, of laws of their own too.
LAWS = {"bouc_wen": {"law": "bouc_wen", **JOINT}} | JOINTS | ELASTIC
IN_A_ROW = {law: [{"points": "m2", "joint": joint}] for law, joint in LAWS.items()}
IN_A_ROW[ALWAYS] = [{"points": "m2", "against": "m1"}]
# A body with a mass beside it, and two entries of joints.
OWN_ON_BODY = REDUCED | {
    "further_masses": [{"name": "damper", "mass": 1}],
    "joints": [
        {"points": "pad", "direction": "-z", "joint": CONTACT},
        {"points": "ring", "direction": "x"},
    ],
}
GIVEN["vibration"] = {
    "structure": {
        "reduced": REDUCED,
        "matrices": MATRICES,
        "points": POINTS,
        "friction_rig": FRICTION_RIG,
    },
    "structure.driven": {"load": {"load": 1}},
    **DAMPING,
    **EXCITED,
    "joint": JOINTS | {"friction_contact": CONTACT} | ELASTIC,
    "ring": {ALWAYS: {"sectors": 24, "axis": "turning", "faces": FACES}},
    "loops": {ALWAYS: {"frequency": "100 Hz"}},
    "modes": {ALWAYS: {"amplitudes": ["0.1 um", "20 um"]}},
    "further_branches": {ALWAYS: [{"force": "40 N", "frequency": "200 Hz", "amplitude": "50 um"}]},
}
GIVEN["reduced_wear"] = {
    "structure": {"matrices": MATRICES},
    "structure.driven": {"load": {"load": 1}},
    "joint.pressed": {ALWAYS: {"points": "ring", "direction": "-z"}},
    **DAMPING,
    **excited("pad"),
    **laws({"force": 1, "frequency": 1, "cycles": [10]}, "body_1", "body_2"),
}
GIVEN["rig"] = GIVEN["joint"] | {
    "structure": {"reduced": OWN_ON_BODY, "matrices": MATRICES},
    "structure.driven": {"load": {"load": 1}},
    **DAMPING,
    "joint": JOINTS | {"friction_contact": CONTACT},
    "ageing": {ALWAYS: {"cycles": 1000}},
    "excitation": {
        "hammer": {"kind": "hammer", "force": 1, "duration": 4e-4, "record": 1, "band": [1, 500]},
        "recorded": {"kind": "recorded", "file": "force.csv"},
    },
}
# What a ring asks for beside itself.
RING = [f"structure={POINTS}", "engine_order=4"]
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
# Each of the matrices in a file of its own.
APART_MATRICES = {
    "stiffness": "k.mtx",
    "mass": "m.mtx",
    "damping": "c.mtx",
    "loads": "f.mtx",
    "unknowns": "unknowns.csv",
}
APART = f"structure.matrices={APART_MATRICES | {'units': {'length': 'mm', 'force': 'N'}}}"
# A sector of a wheel in the place of the template's mesh, with the same names.
SECTOR = "structure.file=sector.msh"
# Further overrides that the entries of a section need.
WITH_SECTION = {
    "structure.other_bodies.": [f"structure.contacts={BOLTED}"],
    "ring.": RING,
    "structure.cyclic.": [SECTOR],
}
# Cells of the templates that may take heights.
CELLS = {"mesh": (96, 192), "resultants": (96, 192)}
CELLS |= dict.fromkeys(("bodies", "bodies_wear"), (128, 128))
CELLS |= dict.fromkeys(("line", "line_wear"), (512,))


@dataclass(frozen=True)
class Leaf:
    """Entry in one of its places: a kind of case, a dotted key there, the kinds of sections.

    ``declared`` is the section that declares it, possibly a base of other sections.
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
        """Overrides that add the entry to the template."""
        overrides = []
        for section, given in (PLAIN | GIVEN.get(self.kind, {})).items():
            if self.key.startswith(f"{section}."):
                chosen = [given[tag] for tag in (*self.tags, ALWAYS) if tag in given]
                overrides += [f"{section}={value}" for value in chosen[:1]]
        overrides += self._shaken
        for section, further in WITH_SECTION.items():
            if self.key.startswith(section):
                overrides += further
        if "legs" in self.tags:
            overrides.append("contact.method=full")
        if "pretension" in self.tags:
            overrides += ["load_path.cycle_from=2", "load_path.peak_leg=2"]
        if self.key.startswith("structure.joints.") and "rig" in self.tags:
            joints = [IN_A_ROW[tag] for tag in (*self.tags, ALWAYS) if tag in IN_A_ROW]
            overrides.append(f"structure.joints={joints[0]}")
        # What wears stands alone: laws of its own are refused.
        if "friction_contact" in self.tags and self.kind != "reduced_wear":
            own = self.key.startswith("structure.")
            overrides.append(f"structure={OWN_ON_BODY if own else REDUCED}")
        if "friction_rig" in self.tags:
            overrides.append(f"joint={CONTACT | {'normal_load': 60}}")
        return overrides

    @property
    def _shaken(self) -> list[str]:
        """Overrides that an excitation of a steady vibration replaces."""
        if self.key.startswith("excitation."):
            return SHAKEN.get(self.kind, [])
        if self.key == "wear.level":
            given = GIVEN[self.kind]["excitation"][ALWAYS]
            return [f"excitation={given}", *SHAKEN[self.kind]]
        return []

    @property
    def is_list(self) -> bool:
        return "tuple" in str(self.field.annotation)

    def listed(self, first, last):
        """Return a list as long as the example, whose last value differs from those before."""
        (example,) = self.field.examples
        if not isinstance(example, list):  # it may stand alone
            return last
        return f"[{', '.join([first] * (len(example) - 1) + [last])}]"


def declaring(model: type[Section], name: str) -> type[Section]:
    """Return the section that declares an entry which ``model`` has or inherits."""
    return next(base for base in model.__mro__ if name in inspect.get_annotations(base))


def leaves(model, path=(), tags=()):
    """Yield ``(path, tags, field, declaring section)`` of every leaf, in every place.

    Lists are entered at 0, unions at all their kinds.
    """
    for name, field in model.model_fields.items():
        sections = list(sections_of(field.annotation))
        index = (0,) if get_origin(field.annotation) is tuple and sections else ()
        for section in sections:
            choices = [section.model_fields[key] for key in ("law", "shape", "kind", "scope")
                       if key in section.model_fields and len(sections) > 1]  # fmt: skip
            tag = [get_args(choice.annotation)[0] for choice in choices[:1]]
            tag += [max(section.known_by)] if section.known_by else []
            yield from leaves(section, (*path, name, *index), (*tags, *tag))
        if not sections:
            yield (*path, name), tags, field, declaring(model, name)


def in_all_places() -> Iterator[Leaf]:
    for kind, model in kinds().items():
        for path, tags, field, declared in leaves(model):
            yield Leaf(kind, ".".join(map(str, path)), tags, field, declared)


def first_of_each(places: list[Leaf]) -> list[Leaf]:
    """Return every declared entry, in the first of its places."""
    first: dict[tuple[type[Section], str], Leaf] = {}
    for leaf in places:
        first.setdefault((leaf.declared, leaf.name), leaf)
    return list(first.values())


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
