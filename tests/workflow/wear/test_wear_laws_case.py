"""Tests of wear laws in cases: one or two, constant or changing with energy; mission mixes."""

import numpy as np
import pytest

from sa_solver.types import Array
from wear.evolution import EnergyTable
from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import load_case, parse_case

ARCHARD = "{law: archard, coefficient: 1e-4, hardness: 3.5 GPa}"
ENERGY = "{law: energy, coefficient: 2e4 um^3/J}"
AMPLITUDE = "{law: energy_amplitude, coefficient: 3e4 um^3/J}"


def laws(path, *overrides):
    """Return the laws of body 1 and body 2 of the dovetail."""
    case = load_case(path, overrides)
    return tuple(case.wear_of(number).described() for number in (1, 2))


def refused(path, *overrides):
    """Return the line that refuses a case."""
    with pytest.raises(CaseError) as refusal:
        load_case(path, overrides)
    (line,) = str(refusal.value).splitlines()
    return line


# --- two laws -------------------------------------------------------------------------------------


def test_both_bodies_wear_by_the_law_of_the_section(dovetail_path):
    assert laws(dovetail_path) == (EnergyLaw(1e-8), EnergyLaw(1e-8))
    amplitude = ["wear.law=energy_amplitude", "wear.reference_amplitude=75 um"]
    assert laws(dovetail_path, *amplitude) == (EnergyAmplitudeLaw(1e-8, 0.075),) * 2


@pytest.mark.parametrize("law", ["energy", "archard", "energy_amplitude"])
def test_a_body_may_name_its_own_law(dovetail_path, law):
    """The law of the section is then that of the other body, whatever it is."""
    needed = {"archard": ["wear.blade.coefficient=1e-4", "wear.blade.hardness=4 GPa"],
              "energy_amplitude": ["wear.reference_amplitude=75 um"]}  # fmt: skip
    blade = {
        "energy": EnergyLaw(1e-8),
        "archard": ArchardLaw(1e-4, 4000.0),
        "energy_amplitude": EnergyAmplitudeLaw(1e-8, 0.075),
    }[law]
    section = [f"wear.law={law}", *needed.get(law, [])]
    for entry, disk in ((ARCHARD, ArchardLaw(1e-4, 3500.0)), (ENERGY, EnergyLaw(2e-8))):
        assert laws(dovetail_path, *section, f"wear.disk={entry}") == (disk, blade)


@pytest.mark.parametrize(
    "written", ["3e-5 mm^3/(N*m)", "3e-5 mm³/(N·m)", "3e-5 mm^3/(N m)", "3e-5 mm3/Nm", "3e-8 1/MPa"]
)
def test_archard_takes_the_specific_wear_rate(dovetail_path, written):
    """The entry k = V / (P s) = K / H is accepted in any unit."""
    entry = f"wear.disk={{law: archard, specific_wear_rate: {written}}}"
    law, _ = laws(dovetail_path, entry)
    assert law.coefficient / law.hardness == pytest.approx(3e-8, rel=1e-15)
    case = load_case(dovetail_path, [entry])
    assert parse_case(dump_case(case), "dump") == case
    assert case.wear_of(1).rate(0.4) == law.coefficient
    # An energy law wears as much with α = k / µ.
    assert case.wear_of(2).rate(0.4) == 0.4 * case.wear_of(2).coefficient


def test_reference_amplitude_is_of_the_section_or_of_the_body(dovetail_path):
    disk = f"wear.disk={AMPLITUDE}"
    first, _ = laws(dovetail_path, disk, "wear.reference_amplitude=50 um")
    assert first == EnergyAmplitudeLaw(3e-8, 0.05)
    second, _ = laws(dovetail_path, disk, "wear.disk.reference_amplitude=20 um")
    assert second == EnergyAmplitudeLaw(3e-8, 0.02)


@pytest.mark.parametrize(
    "overrides",
    [
        [f"wear.disk={ARCHARD}"],
        [f"wear.disk={AMPLITUDE}", "wear.reference_amplitude=50 um"],
        ["wear.disk.evolution={scope: global, energy: [0, 1 kJ], factor: [1, 0.3]}"],
        ["friction.evolution={energy: [0, 1 kJ], factor: [1, 1.5]}"],
        ["load_path.mix=[{share: 70 %}, {share: 30 %, rotation_speed: 5000 rpm}]"],
    ],
)
def test_dump_reads_back_equal(dovetail_path, overrides):
    case = load_case(dovetail_path, overrides)
    text = dump_case(case)
    assert parse_case(text, "dump") == case
    assert dump_case(parse_case(text, "dump")) == text


TABLE = "wear.disk.evolution={scope: local, energy: [%s], factor: [%s]}"


@pytest.mark.parametrize(
    ("override", "key"),
    [
        ("wear.disk.law=wishful", "wear.disk.law"),
        ("wear.disk.evolutoin=1", "wear.disk.evolutoin"),
        ("wear.disk={law: archard, coefficient: 1e-4}", "wear.disk.hardness"),
        ("wear.disk={law: archard, hardness: 3 GPa}", "wear.disk.coefficient"),
        (f"wear.disk={ARCHARD[:-1]}, specific_wear_rate: 1e-8}}", "wear.disk.specific_wear_rate"),
        ("wear.disk.specific_wear_rate=1e-8 1/MPa", "wear.disk.specific_wear_rate"),
        ("wear.disk.coefficient=1e-5 mm³/N·m", "wear.disk.coefficient"),
        (f"wear.disk={AMPLITUDE}", "wear.reference_amplitude"),
        ("wear.reference_amplitude=75 um", "wear.reference_amplitude"),
        ("wear.disk.evolution={energy: [0], factor: [1]}", "wear.disk.evolution.scope"),
        (TABLE % ("0, 1", "1"), "wear.disk.evolution.factor"),
        (TABLE % ("1, 1", "1, 2"), "wear.disk.evolution.energy"),
        ("friction.evolution={energy: [0, 1 J], factor: [1, 6]}", "friction.evolution.factor"),
        ("load_path.mix=[{share: 70 %}, {share: 20 %}]", "load_path.mix"),
    ],
)
def test_wrong_entries_are_named(dovetail_path, override, key):
    line = refused(dovetail_path, override)
    assert f"{key}: " in line or line.startswith(f"--set {key}="), line


# --- evolution ------------------------------------------------------------------------------------


def test_evolution_reaches_the_law_in_base_units(dovetail_path):
    disk, blade = laws(
        dovetail_path,
        "wear.disk.evolution={scope: local, energy: [0, 2 J/mm^2], factor: [1, 30 %]}",
        f"wear.blade={ARCHARD}",
        "wear.blade.evolution={scope: global, threshold: 3 J}",
    )
    assert disk == EvolvingLaw(EnergyLaw(1e-8), EnergyTable((0.0, 2000.0), (1.0, 0.3)), "local")
    constant = EnergyTable((0.0,), (1.0,), threshold=3000.0)
    assert blade == EvolvingLaw(ArchardLaw(1e-4, 3500.0), constant, "global")


def test_friction_follows_its_table(dovetail_path):
    assert load_case(dovetail_path).friction.at(1e9) == 0.4
    friction = load_case(
        dovetail_path, ["friction.evolution={energy: [0, 1 kJ], factor: [0.5, 1.5]}"]
    ).friction
    assert [friction.at(e) for e in (0.0, 5e5, 1e9)] == pytest.approx([0.2, 0.4, 0.6], rel=1e-14)


# --- schema and template --------------------------------------------------------------------------


# --- mixes ----------------------------------------------------------------------------------------


def amplitudes(path, *overrides) -> list[Array]:
    from workflow.analyses.wear.structures.dovetail.model import dovetail_joint

    return [loads.amplitudes for loads in dovetail_joint(load_case(path, overrides)).load_cycles]


def test_missions_of_a_mix_differ_only_in_what_they_name(dovetail_path):
    from workflow.analyses.wear.structures.dovetail.model import dovetail_joint

    mix = "[{share: 30 %, rotation_speed: 3000 rpm, aerodynamic_moment: 20 N*m}, {share: 0.7}]"
    model = dovetail_joint(load_case(dovetail_path, [f"load_path.mix={mix}"]))
    (whole,) = amplitudes(dovetail_path)
    low, full = model.load_cycles
    assert (low.share, full.share) == (0.3, 0.7)
    np.testing.assert_array_equal(full.amplitudes, whole)
    np.testing.assert_allclose(low.amplitudes[:, 0], 0.25 * whole[:, 0], rtol=1e-14)
    np.testing.assert_allclose(low.amplitudes[:, 1], 2.0 / 3.0 * whole[:, 1], rtol=1e-14)
    # Peak load is that of the heaviest mission.
    assert model.peak == 22 + 7
