"""Tests of materials by name: their values, changes to them, and where mass matters."""

import pytest

from tests.conftest import CASES
from workflow.case.materials import MATERIALS
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import load_case, parse_case

TITANIUM = {"young": 113.8e3, "poisson": 0.342, "density": 4.43e-9, "yield_stress": 880.0}
NUMBERS = "{young: 113.8 GPa, poisson: 0.342, density: 4430 kg/m^3, yield_stress: 880 MPa}"


def refused(path, *overrides):
    """Return the line that refuses a case."""
    with pytest.raises(CaseError) as refusal:
        load_case(path, overrides)
    (line,) = str(refusal.value).splitlines()
    return line


@pytest.mark.parametrize("name", MATERIALS)
def test_they_are_metals_and_ceramics_in_their_own_units(name):
    """Values and wave speeds are in the range of real materials, so no unit or digit is wrong."""
    known = MATERIALS[name]
    assert 60.0 < known.young < 450.0
    assert 0.2 < known.poisson < 0.35
    assert 2500.0 < known.density < 8500.0
    assert 4500.0 < (known.young * 1e9 / known.density) ** 0.5 < 11000.0
    assert known.yield_stress is None or 1e-4 < 1e-3 * known.yield_stress / known.young < 1e-2
    assert known.source
    assert known.state


def test_a_name_stands_for_its_numbers(dovetail_path):
    named, both, numbers = (
        load_case(dovetail_path, [f"materials.blade={body}"])
        for body in ("Ti-6Al-4V", "{material: Ti-6Al-4V}", NUMBERS)
    )
    assert named == both
    assert named.material(2) == numbers.material(2)
    assert named.materials.blade.model_dump() == {"material": "Ti-6Al-4V"} | TITANIUM


def test_an_override_goes_into_a_name(dovetail_path):
    """An override changes an entry of a named material, as in a sweep."""
    overrides = ["materials.blade=Ti-6Al-4V", "materials.blade.young=110 GPa"]
    blade = load_case(dovetail_path, overrides).materials.blade
    assert (blade.material, blade.young, blade.poisson) == ("Ti-6Al-4V", 110e3, 0.342)


def test_the_case_of_a_run_has_name_and_numbers(dovetail_path):
    case = load_case(dovetail_path, ["materials.blade=Ti-6Al-4V", "materials.disk=100Cr6"])
    text = dump_case(case)
    assert "material: Ti-6Al-4V" in text
    assert "young: 113800.0" in text
    assert parse_case(text, "dump") == case


@pytest.mark.parametrize(
    ("written", "meant"),
    [("ti-6al-4v", "Ti-6Al-4V"), ("IN718", "Inconel 718"), ("52100", "100Cr6")],
)
def test_other_names_lead_to_the_known_one(dovetail_path, written, meant):
    assert f"'{meant}'" in refused(dovetail_path, f"materials.blade={written}")


@pytest.mark.parametrize("wrong", ["rust", "5", "[a]"])
def test_other_materials_are_refused(dovetail_path, wrong):
    assert "materials.blade" in refused(dovetail_path, f"materials.blade={wrong}")


def test_density_is_for_bodies_with_inertia(dovetail_path):
    path, density = CASES / "sphere_normal.yaml", "materials.body_1.density=4430 kg/m^3"
    assert "materials.body_1.density" in refused(path, density)
    line = refused(dovetail_path, "materials.blade={young: 1 GPa, poisson: 0.3}")
    assert "materials.blade.density" in line
