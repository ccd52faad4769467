"""Tests of plausibility warnings about unlikely values, and of the scene that ``check`` shows."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, get_args, get_origin

import numpy as np
import pytest
from click.testing import CliRunner

from sa_solver.reference.hertz import HertzCylinder, HertzSphere
from workflow.analyses.rig.plausibility import modes
from workflow.analyses.rig.structure import Rig
from workflow.case.fields import Quantity
from workflow.case.plausibility import SQUARE, USUAL, hertz, plausibility_warnings_of, uneven_cells
from workflow.case.sections import Section, entry_of, sections_of
from workflow.case.text.plain import between, plain
from workflow.cli import cli
from workflow.kinds import kinds, load_case, parse_case, template

CASES = sorted([*Path("cases").glob("*.yaml"), *Path("cases/validation").glob("*.yaml")])


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_nothing_is_doubted_of_our_cases(path: Path) -> None:
    assert list(plausibility_warnings_of(load_case(path))) == []


@pytest.mark.parametrize("kind", kinds())
def test_nothing_is_doubted_of_templates(kind: str, template_files: Path, tmp_path: Path) -> None:
    shutil.copytree(template_files, tmp_path, dirs_exist_ok=True)
    path = tmp_path / "mine.yaml"
    path.write_text(template(kind), encoding="utf-8")
    assert list(plausibility_warnings_of(load_case(path))) == []


LIGHT = "load_path={legs: [{P: 50, Qx: 1e-3}, {Qx: -1e-3}]}"
LEGS = "[{P: 50 kN, shift_x: 25 um}, {shift_x: -25 um}, {shift_x: 25 um}]"
SLIPS = [
    # A unit forgotten, or another than was meant.
    ("dovetail", "materials.blade.young=210 MPa", "210 MPa; usual: 0.3 to 1300 GPa; 210 GPa meant"),
    ("dovetail", "materials.disk.density=4.43 kg/m^3", "500 to 23000 kg/m³; 4.43 g/cm³ meant?"),
    ("dovetail", "friction.coefficient=1.5", "friction.coefficient: 1.5; usual: 0.02 to 1.2"),
    ("joint", "joint.friction=9", "9 % meant?"),
    ("dovetail", "wear.blade.coefficient=0.5 mm^3/J", "5e+08 µm³/J; usual: 1 to 1e+07 µm³/J"),
    ("bodies_wear", "structure.radius=1 um", "1 mm meant?"),
    # Loads against what carries them.
    ("dovetail", "load_path.airfoil_mass=80 kg", "load_path: gives a pressure"),
    ("bodies", "load_path.legs.0.P=4e7", "75 times the yield stress"),
    (
        "bodies_wear",
        "load_path.P=50 kN",
        "load_path.P: gives a pressure of about 7.25e+03 MPa, 8 times",
    ),
    (
        "bodies_wear",
        f"load_path={{legs: {LEGS}}}",
        "load_path: gives a pressure of about 7.25e+03 MPa",
    ),
    ("line", "load_path.legs.0.P=1e7", "times the yield stress"),
    ("line_wear", "load_path.P=50 kN/mm", "times the yield stress"),
    ("specimens", "load_path.normal_forces=[17 kN]", "load_path.normal_forces.0: gives a pressure"),
    # Lengths against each other, and cycles.
    ("specimens", "load_path.stroke=14 mm", "longer than the pad (1 mm)"),
    ("line_wear", "load_path.stroke=20 mm", "times the width of the contact"),
    ("dovetail", "contact.grid=[512, 16]", "175 times longer than wide"),
    ("bodies", "contact.grid=[512, 16]", "32 times longer than wide"),
    ("dovetail", "wear.step.cycles=1e6", "1e+06 cycles"),
    ("dovetail", "structure.edge_radius=30 m", "37.5 nm"),
    ("dovetail", "load_path.aerodynamic_moment=30 kN*m", "would lift the blade off a flank"),
    # Contacts and their grids, shear and friction.
    ("bodies", "contact.size=[1 m, 1 m]", "contact.size: cells of 7.81 mm"),
    ("bodies_wear", "contact.size=[1 um, 1 um]", "contact.size: 1 µm is smaller"),
    ("line", "structure.radius=10 m", "contact.size: 2 mm is smaller"),
    ("bodies", "load_path={legs: [{P: 400 N}, {Qx: 15 kN}]}", "friction carries, 160 N"),
    ("bodies", "load_path={legs: [{P: 400 N}, {Qx: 15 mN}]}", "Qx up to 15 mN"),
    ("bodies_wear", LIGHT, "Qx up to 1 mN are far below what friction carries, 20 N"),
    # Rigs: springs, masses and forces, and the modes that they make.
    ("vibration", "structure.masses=[21.2 g, 1.2 g]", "frequencies: no mode of the rig is near"),
    ("vibration", "frequencies=[20 kHz, 400 kHz]", "frequencies: no mode of the rig is near"),
    ("rig", "excitation.frequency=100 kHz", "excitation.frequency: no mode of the rig is near"),
]


def told_of(kind: str, slip: str, folder: Path) -> list[str]:
    path = folder / "mine.yaml"
    path.write_text(template(kind), encoding="utf-8")
    return list(plausibility_warnings_of(load_case(path, [slip, *BESIDE.get(slip, ())])))


# Further changes that make a case valid.
BESIDE = {
    "load_path.stroke=20 mm": ("contact.size=40 mm",),
    "excitation.frequency=100 kHz": ("integration.step=0.1 us",),
    LIGHT: ("contact.method=full",),
    "contact.size=[1 um, 1 um]": ("wear.motion=neglect",),
}


@pytest.mark.parametrize(("kind", "slip", "words"), SLIPS, ids=[slip for _, slip, _ in SLIPS])
def test_a_slip_is_doubted(kind: str, slip: str, words: str, tmp_path: Path) -> None:
    """The warning names the entry, on one line."""
    reported = [warning for warning in told_of(kind, slip, tmp_path) if words in warning]
    assert reported, told_of(kind, slip, tmp_path)
    # What two entries say together is told of one of them.
    together = "no mode of the rig", "smaller than the contact"
    assert slip.replace("=", ".").split(".")[0] in reported[0] or any(
        w in reported[0] for w in together
    )
    assert "\n" not in reported[0]


@pytest.mark.parametrize(
    ("slip", "words"),
    [
        ("structure.contacts.0.gap.end_width=3 um", "contacts.0.gap.end_radius: 150 mm over end_"),
        ("structure.loads.0.pressure=10 GPa", "structure.loads.0.pressure: 10 GPa; usual"),
    ],
)
def test_a_slip_beside_a_mesh_is_doubted(slip: str, words: str, folders: dict[str, Path]) -> None:
    (reported,) = plausibility_warnings_of(
        parse_case(template("mesh"), str(folders["mesh"] / "case.yaml"), [slip])
    )
    assert words in reported


def test_modes_are_those_of_masses_in_a_row() -> None:
    """Two masses of 1 kg on springs of 1 N/um have ω² = (3 ∓ √5)/2 k/m, or k/m and 3 k/m."""
    rig = Rig(kind="rig", masses=(1e-3, 1e-3), springs=(1e3, 1e3), damping_ratio=0.0)
    opened = np.sqrt(0.5 * (3.0 + np.sqrt(5.0) * np.array([-1.0, 1.0])))
    for held, expected in ((0.0, opened), (1e3, np.sqrt([1.0, 3.0]))):
        assert 2.0 * np.pi * modes(rig, held) == pytest.approx(1e3 * expected, rel=1e-12)


@pytest.mark.parametrize(("scale", "words"), [(1e3, "are they in µm?"), (1e-3, "are they in m?")])
def test_heights_in_another_unit_are_doubted(scale: float, words: str, tmp_path: Path) -> None:
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
    (reported,) = plausibility_warnings_of(load_case(path, [*heights_case, slip]))
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


def test_cells_are_uneven_beyond_a_limit() -> None:
    assert list(uneven_cells((1.0, 1.0), (16, int(16 * SQUARE)))) == []
    assert list(uneven_cells((1.0, 1.0), (16, int(16 * SQUARE) + 1))) != []
    assert list(uneven_cells((1.0, 1.0), (4096, 1))) == []


def test_a_check_tells_the_scene_and_doubts_and_still_is_right() -> None:
    slip = "materials.blade.young=210 MPa"
    reported = CliRunner().invoke(cli, ["check", "cases/dovetail.yaml", "--set", slip])
    assert reported.exit_code == 0
    for words in (
        "6000 rpm, airfoil 0.8 kg at 400 mm: 126.3 kN",
        "disk: young 115 GPa, poisson 0.29, yield stress 900 MPa, density 4430 kg/m³",
        "wear law   disk and blade: energy, coefficient 10000 µm³/J",
        "cells of 85.94 µm x 0.2344 mm",
        "\nwarning: materials.blade.young: 210 MPa",
    ):
        assert words in reported.stdout


@pytest.mark.parametrize(
    ("number", "unit", "printed"),
    [
        (115e3, "MPa", "115 GPa"),
        (0.014, "mm", "14 µm"),
        (0.0, "mm", "0 mm"),
        (628.318530718, "rad/s", "6000 rpm"),
    ],
)
def test_numbers_are_said_in_plain_units(number: float, unit: str, printed: str) -> None:
    assert plain(number, unit) == printed


def test_a_range_is_said_in_one_unit() -> None:
    assert between(-120.0, 60.0, "N/mm") == "-120 to 60 N/mm"
