"""Tests of motions at chosen frequencies and harmonics of a vibration case."""

import csv

import h5py
import numpy as np
import pytest

from tests.workflow.vibration.test_vibration_case import RIG, SAMPLED, STIFFNESS
from tests.workflow.vibration.time_scenes import receptance, run
from workflow.shell.output.results import own

FORCE, AT = 2.0, (75.0, 120.0)


@pytest.fixture(scope="module")
def stuck(tmp_path_factory):
    """Return folder and summary of a rig whose joint sticks."""
    folder = tmp_path_factory.mktemp("stuck")
    asked = ("at=[75 Hz, 120 Hz]", "harmonics_along_curves=true", "resolution.harmonics=2")
    return folder, run(folder, RIG, "joint.friction=10", "forces=[2 N]", *asked)


def test_answers_are_exactly_at_the_frequencies(stuck):
    _, summary = stuck
    (response,) = summary["responses"]
    assert [answer["frequency"] for answer in response["at"]] == list(AT)
    for answer in response["at"]:
        (motion,) = answer["motions"]
        assert answer["message"] == ""
        wanted = FORCE * receptance(answer["frequency"], STIFFNESS)[-1]
        assert motion["amplitude"] == pytest.approx(abs(wanted), rel=SAMPLED)
        assert motion["phase"] == pytest.approx(np.angle(wanted), abs=1e-9)
        assert motion["energy_per_cycle"] == 0.0
        assert motion["error"] < 1e-9


def test_harmonics_are_those_of_the_closed_form(stuck):
    """Both masses, the joint's stretch and its force agree, at frequencies and on the curve."""
    folder, summary = stuck
    with h5py.File(folder / "out" / "results.h5") as file:
        names = {
            name: file["names"][name][()].astype(str).tolist() for name in ("places", "joints")
        }
        groups = {
            group: {name: datasets[name][()] for name in own(datasets)}
            for group, datasets in file["responses/00000/harmonics"].items()
        }
        assert "Re(c_k" in file["responses/00000/harmonics/curve/joint_force"].attrs["description"]
    assert names == {"places": ["m1", "m2"], "joints": [["m2"]]}
    assert set(groups) == {"at_00000", "at_00001", "curve", "resonance"}
    assert groups["resonance"]["frequency"] == summary["responses"][0]["resonance"]
    motions = [groups["at_00000"], groups["at_00001"]]
    along = groups["curve"]
    for place, frequency in enumerate(along["frequency"]):
        motions.append(
            {name: along[name][place] for name in along if name not in ("frequency", "harmonic")}
            | {"frequency": frequency, "harmonic": along["harmonic"]}
        )
    assert len(motions) > 20
    for motion in motions:
        # A sine is Re (-i) exp(iωt).
        wanted = -1j * FORCE * receptance(float(motion["frequency"]), STIFFNESS)
        assert motion["harmonic"].tolist() == [1, 3]
        np.testing.assert_allclose(motion["displacement"][0], wanted, rtol=1e-7)
        np.testing.assert_allclose(motion["joint_displacement"][0, 0, 0], wanted[1], rtol=1e-7)
        pulled = STIFFNESS * wanted[1]
        np.testing.assert_allclose(motion["joint_force"][0, 0, 0], pulled, rtol=1e-7)
        size = np.abs(wanted).max()
        np.testing.assert_allclose(motion["displacement"][1], 0.0, atol=1e-9 * size)


def test_tables_have_their_units_and_convention(stuck):
    folder, _ = stuck
    with (folder / "out" / "harmonics_00000.csv").open(encoding="utf-8") as file:
        assert "Re(c_k exp(i k 2 pi f t))" in file.readline()
        rows = list(csv.DictReader(file))
    chosen = [row for row in rows if row["motion"] == "1" and row["harmonic"] == "1"]
    assert [row["name"] for row in chosen] == ["m1", "m2", "m2"]
    wanted = -1j * FORCE * receptance(AT[0], STIFFNESS)
    moved = complex(
        *(float(chosen[1][f"displacement_{part} [mm]"]) for part in ("real", "imaginary"))
    )
    assert moved == pytest.approx(wanted[1], rel=1e-7)
    assert chosen[1]["force_real [N]"] == ""
    assert float(chosen[2]["force_real [N]"]) == pytest.approx(STIFFNESS * wanted[1].real, rel=1e-7)
    with (folder / "out" / "at_00000.csv").open(encoding="utf-8") as file:
        asked = list(csv.DictReader(file))
    assert [row["frequency [Hz]"] for row in asked] == ["75", "120"]
