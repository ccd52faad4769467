"""Tests of specimens of a friction rig that wear as models in Python."""

from dataclasses import replace

import fretscale
import numpy as np
import pytest

from fe_models import FrettingConditions
from fe_models.geometry import Specimen
from sa_solver import InputError, Material
from tests.conftest import CASES
from wear import EnergyLaw
from workflow.analyses.specimens.model import fretted_specimens
from workflow.shell.folders.cache import DiskStore

STEEL = Material(200e3, 0.3, density=7.8e-9)


@pytest.fixture(scope="module")
def model():
    """Return coarse flat specimens under 60 N, of which body 2 wears three times as fast."""
    coarse = {"size": 4.0, "order": 1, "modes": 2}
    pair = fretscale.SpecimenPair(Specimen(pad_elements=4), (STEEL, STEEL), **coarse)
    laws = EnergyLaw(1.5e-9), EnergyLaw(4.5e-9)
    return fretscale.FrettedSpecimens(pair, FrettingConditions(60.0, 0.014, 0.88), laws, cycles=1e4)


def test_a_model_wears_as_its_case(tmp_path, monkeypatch):
    # Specimens that other processor instructions reduced differ in their last digits.
    monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / "cache"))
    case = fretscale.load_case(
        CASES / "specimens_coarse.yaml",
        mesh={"pad_elements": 4, "size": "4 mm", "order": 1},
        reduction__modes=2,
        contact__grid=[16, 16],
        wear__cycles=1e4,
        output__figures=False,
        output__paraview=False,
    )
    written = fretscale.run(case, tmp_path / "out", quiet=True)
    worn = fretted_specimens(case, 60.0).run(store=DiskStore())
    (load,) = written.summary["loads"]
    assert load["cycle_blocks"] == len(worn["cycles"]) - 1 > 0
    assert load["energy"] == worn["energy"].values[-1]
    assert load["volumes"] == [worn[f"volume_{body}"].values[-1] for body in (1, 2)]
    assert load["depths"] == [worn[f"depth_{body}"].values[-1].max() for body in (1, 2)]
    for place, state in ((0, "unworn"), (-1, "worn")):
        for name in ("stick_stiffness", "area", "energy_per_cycle", "friction"):
            assert load[state][name] == worn[name].values[place]


def test_each_body_wears_by_its_coefficient(model):
    worn = replace(model, cycles=3e3).run()
    for body, coefficient in ((1, 1.5e-9), (2, 4.5e-9)):
        np.testing.assert_allclose(worn[f"volume_{body}"], coefficient * worn["energy"])
    assert worn["cycles"].values[[0, -1]].tolist() == [0.0, 3e3]
    areas = model.specimens.reduced.pair.areas
    np.testing.assert_allclose(worn["pressure"].values @ areas, 60.0, rtol=1e-7)
    assert worn["pressure"].attrs["units"] == "MPa"


def test_a_run_ends_with_the_block_that_reaches_its_energy(model):
    by_energy = replace(model, cycles=None, energy=500.0).run()
    assert by_energy["energy"].values[-2] < 500.0 <= by_energy["energy"].values[-1]


def test_an_end_is_given_once(model):
    for ends in ({"energy": 1.0}, {"cycles": None}):
        with pytest.raises(InputError, match="give one"):
            replace(model, **ends)


def test_an_energy_that_nothing_dissipates_is_refused(model):
    still = FrettingConditions(60.0, 0.0, 0.88)
    with pytest.raises(fretscale.UserError, match="nothing slides"):
        replace(model, conditions=still, cycles=None, energy=1.0).run()


def test_an_added_gap_is_on_top_of_the_form(model):
    bump = fretscale.AddedGap(lambda x, y: 1e-3 * x + 0.0 * y)
    face = replace(model.specimens, added=bump).reduced.face
    flat = model.specimens.reduced.face
    np.testing.assert_allclose(face.gap - flat.gap, 1e-3 * face.coordinates[:, 0], atol=1e-15)


def test_blocks_are_within_their_stability_limit(model):
    with pytest.raises(InputError, match="1 or less"):
        replace(model, fraction=1.5)


def test_specimens_that_wear_keep_no_further_point(model):
    with pytest.raises(InputError, match="target_distance"):
        replace(model, specimens=replace(model.specimens, target_distance=1.0))
