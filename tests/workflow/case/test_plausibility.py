"""Tests of plausibility warnings about unlikely values, and of the scene that ``check`` shows."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, get_args, get_origin

import numpy as np
import pytest

from sa_solver.reference.hertz import HertzCylinder, HertzSphere
from workflow.analyses.rig.plausibility import modes
from workflow.analyses.rig.structure import Rig
from workflow.case.fields import Quantity
from workflow.case.plausibility import USUAL, hertz, plausibility_warnings_of
from workflow.case.sections import Section, entry_of, sections_of
from workflow.kinds import kinds, load_case, template
from workflow.messages.warning_kinds import WarningKind

CASES = sorted([*Path("cases").glob("*.yaml"), *Path("cases/validation").glob("*.yaml")])


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
@pytest.mark.usefixtures("reads_here")
def test_shipped_cases_give_no_warnings(path: Path) -> None:
    assert list(plausibility_warnings_of(load_case(path))) == []


@pytest.mark.parametrize("kind", kinds())
def test_templates_give_no_warnings(kind: str, template_files: Path, tmp_path: Path) -> None:
    shutil.copytree(template_files, tmp_path, dirs_exist_ok=True)
    path = tmp_path / "mine.yaml"
    path.write_text(template(kind), encoding="utf-8")
    assert list(plausibility_warnings_of(load_case(path))) == []


LIGHT = "load_path={legs: [{P: 50, Qx: 1e-3}, {Qx: -1e-3}]}"
SLIPS = [
    # A unit forgotten, or another than was meant.
    ("dovetail", "materials.blade.young=210 MPa", "210 GPa"),
    ("dovetail", "materials.disk.density=4.43 kg/m^3", "4.43 g/cm³"),
    ("dovetail", "friction.coefficient=1.5", "friction.coefficient"),
    ("dovetail", "wear.blade.coefficient=0.5 mm^3/J", "wear.blade.coefficient"),
    # Loads against what carries them.
    ("dovetail", "load_path.airfoil_mass=80 kg", "load_path"),
    ("bodies", "load_path.legs.0.P=4e7", "75 times the yield stress"),
    ("line_wear", "load_path.P=50 kN/mm", "times the yield stress"),
    ("specimens", "load_path.normal_forces=[17 kN]", "load_path.normal_forces.0"),
    # Lengths against each other, and cycles.
    ("specimens", "load_path.stroke=14 mm", "load_path.stroke"),
    ("dovetail", "contact.grid=[512, 16]", "contact.grid"),
    ("dovetail", "wear.step.cycles=1e6", "wear.step.cycles"),
    ("dovetail", "wear.step={kind: explicit, fraction: 5}", "wear.step.fraction"),
    ("dovetail", "load_path.aerodynamic_moment=30 kN*m", "load_path.aerodynamic_moment"),
    # Contacts and their grids, shear and friction.
    ("bodies", "contact.size=[1 m, 1 m]", "contact.size"),
    ("line", "structure.radius=10 m", "contact.size"),
    ("bodies", "load_path={legs: [{P: 400 N}, {Qx: 15 kN}]}", "160 N"),
    ("bodies_wear", LIGHT, "20 N"),
    # Rigs: springs, masses and forces, and the modes that they make.
    ("vibration", "frequencies=[20 kHz, 400 kHz]", "frequencies"),
]


def told_of(kind: str, slip: str, folder: Path) -> list[str]:
    path = folder / "mine.yaml"
    path.write_text(template(kind), encoding="utf-8")
    case = load_case(path, [slip, *BESIDE.get(slip, ())])
    return list(map(str, plausibility_warnings_of(case)))


# Further changes that make a case valid.
BESIDE = {LIGHT: ("contact.method=full",)}


@pytest.mark.parametrize(("kind", "slip", "words"), SLIPS, ids=[slip for _, slip, _ in SLIPS])
def test_an_unlikely_value_gives_a_warning(kind: str, slip: str, words: str, tmp_path: Path):
    assert any(words in warning for warning in told_of(kind, slip, tmp_path))


def test_modes_are_those_of_masses_in_a_row() -> None:
    """Two masses of 1 kg on springs of 1 N/um have ω² = (3 ∓ √5)/2 k/m, or k/m and 3 k/m."""
    rig = Rig(kind="rig", masses=(1e-3, 1e-3), springs=(1e3, 1e3), damping_ratio=0.0)
    opened = np.sqrt(0.5 * (3.0 + np.sqrt(5.0) * np.array([-1.0, 1.0])))
    for held, expected in ((0.0, opened), (1e3, np.sqrt([1.0, 3.0]))):
        assert 2.0 * np.pi * modes(rig, held) == pytest.approx(1e3 * expected, rel=1e-12)


@pytest.mark.parametrize(("scale", "words"), [(1e3, "are they in µm?"), (1e-3, "are they in m?")])
def test_heights_in_another_unit_give_a_warning(scale: float, words: str, tmp_path: Path) -> None:
    """The heights are 1 µm of roughness, and a paraboloid below it, on a face of 1 mm."""
    x = np.linspace(-0.5, 0.5, 16)
    heights = 1e-3 * np.sin(20.0 * x)[:, None] + np.zeros((16, 16))
    np.save(tmp_path / "gap.npy", heights)
    heights_case = ["structure={kind: bodies, shape: heights, file: gap.npy}"]
    slip = "contact={grid: [16, 16], size: [1 mm, 1 mm]}"
    path = tmp_path / "mine.yaml"
    path.write_text(template("bodies"), encoding="utf-8")
    assert list(plausibility_warnings_of(load_case(path, [*heights_case, slip]))) == []
    np.save(tmp_path / "gap.npy", scale * heights)
    ((kind, reported),) = plausibility_warnings_of(load_case(path, [*heights_case, slip]))
    assert kind is WarningKind.UNUSUAL_LENGTH
    assert words in reported


def test_all_that_is_usual_is_usual_of_some_entry() -> None:
    """Each pattern matches an entry by path and unit, so none is misspelt."""
    leaves = {(path, unit) for kind in kinds().values() for path, unit in quantities_of(kind)}
    for usual in USUAL:
        assert any(unit == usual.unit and fnmatchcase(path, usual.path) for path, unit in leaves)


def quantities_of(model: type[Section], path: str = "") -> Iterator[tuple[str, str | None]]:
    """Yield dotted paths of all quantities that a model may have, and their units."""
    for name, field in model.model_fields.items():
        # A list may be left out: then it is one of several annotations.
        either = (part for part in get_args(field.annotation) if get_origin(part) is Annotated)
        several = (field.annotation, *(get_args(part)[0] for part in either))
        listed = "0." if tuple in map(get_origin, several) else ""
        if isinstance(quantity := entry_of(field), Quantity):
            yield f"{path}{name}.{listed}".rstrip("."), quantity.unit
        for section in sections_of(field.annotation):
            yield from quantities_of(section, f"{path}{name}.{listed}")


def test_contacts_are_those_of_hertz() -> None:
    sphere, cylinder = HertzSphere(50.0, 10.0, 6e4), HertzCylinder(50.0, 10.0, 6e4)
    ball = sphere.contact_radius, sphere.peak_pressure
    roller = cylinder.half_width, cylinder.peak_pressure
    assert hertz(50.0, 10.0, 6e4, line=False) == pytest.approx(ball, rel=1e-12)
    assert hertz(50.0, 10.0, 6e4, line=True) == pytest.approx(roller, rel=1e-12)
