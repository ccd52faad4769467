"""Tests of joints that wear at a stroke, as models in Python."""

from dataclasses import replace

import fretscale
import numpy as np
import pytest

from sa_solver import InputError
from tests.conftest import CASES
from wear.joints import (
    BoucWen,
    ExponentialEvolution,
    Jenkins,
    JointEvolution,
    LinearEvolution,
    UniformIwan,
)
from wear.joints.ageing import NeverReachedError
from workflow.analyses.time.joint_model import wearing_joint

LAW = Jenkins(stiffness=1e4, friction=0.4, normal_load=60.0)
RISING = JointEvolution(friction=ExponentialEvolution(final=2.0, rate=-1e-3))


def of_stroke(friction):
    """Return the energy of a cycle of the Jenkins element at ± 0.01 mm [N mm]."""
    return 4.0 * 60.0 * friction * (0.01 - 60.0 * friction / 1e4)


def test_a_model_ages_as_its_case(tmp_path):
    case = fretscale.load_case(
        CASES / "bolted_joint_test4.yaml",
        ageing={"cycles": 2000},
        energies=["0 J"],
        output__figures=False,
    )
    written = fretscale.run(case, tmp_path / "out", quiet=True)
    results, summary = wearing_joint(case).run(case.energies), written.summary
    curves = written["evolution"].xarray()
    for name in ("energy", "cycles", "energy_per_cycle", "friction", "stiffness", "normal_load"):
        np.testing.assert_array_equal(results[name].values, curves[name].values)
    assert results["cycles"].values[-1] == pytest.approx(summary["cycles"], rel=1e-12)
    assert results.attrs["cycles_error"] == summary["ageing"]["error"]
    for number in range(2):
        loop = written[f"states/{number:05d}/loop"].xarray()
        for name in ("displacement", "force"):
            computed = results[f"loops/{name}"].values[number]
            np.testing.assert_array_equal(computed, loop[name].values)


def test_energy_grows_by_that_of_each_cycle():
    results = fretscale.WearingJoint(LAW, RISING, stroke=0.02, cycles=3000.0).run()
    total = 0.0
    for _ in range(3000):
        total += of_stroke(0.4 * (2.0 - np.exp(-1e-3 * total)))
    assert results["energy"].values[-1] == pytest.approx(total, rel=1e-4)
    rates = [of_stroke(friction) for friction in results["friction"].values]
    np.testing.assert_allclose(results["energy_per_cycle"], rates, rtol=1e-12)


def test_cycles_and_energy_end_the_same_test():
    by_cycles = fretscale.WearingJoint(LAW, RISING, stroke=0.02, cycles=3000.0)
    end = by_cycles.test().final_energy
    by_energy = replace(by_cycles, cycles=None, energy=end)
    assert by_energy.test().total_cycles == pytest.approx(3000.0, rel=1e-4)


@pytest.mark.parametrize(
    "law",
    [
        BoucWen(stiffness=2e4, friction=0.4, normal_load=60.0),
        UniformIwan(stiffness=2e4, friction=0.4, normal_load=60.0),
    ],
    ids=["bouc_wen", "iwan"],
)
def test_loops_enclose_the_energy_of_a_cycle(law):
    """The area of each loop is the energy per cycle at its energy, by an independent formula."""
    joint = fretscale.WearingJoint(law, RISING, stroke=0.02, cycles=1e4)
    results = joint.run([0.0, 500.0])
    loops = results["loops"]
    for number, energy in enumerate(loops["dissipated"].values):
        force, moved = (loops[name].values[number] for name in ("force", "displacement"))
        area = abs(np.trapezoid(force, moved))
        assert area == pytest.approx(joint.energy_per_cycle(energy), rel=1e-3)
    assert loops["force"].dims == ("state", "point")


def test_an_end_is_given_once_and_energies_lie_before_it():
    joint = fretscale.WearingJoint(LAW, RISING, stroke=0.02, cycles=100.0)
    for ends in ({"cycles": None}, {"energy": 1.0}):
        with pytest.raises(InputError, match="give one"):
            replace(joint, **ends)
    with pytest.raises(InputError, match="outside the test"):
        joint.run([1e9])


def test_an_energy_that_is_never_reached_is_refused():
    """The friction falls until nothing slides at its force any more."""
    stiffer = JointEvolution(friction=LinearEvolution(slope=1e-2))
    joint = fretscale.WearingJoint(LAW, stiffer, stroke=0.02, energy=1e6)
    with pytest.raises(NeverReachedError, match="never reached"):
        joint.run()
