"""Tests of loads that are given for contact faces."""

import fretscale
import numpy as np
import pytest

from sa_solver import InputError, LoadHistory, Material
from wear import CycleLoads, EnergyLaw
from workflow.analyses.wear.model import wear_model
from workflow.kinds import parse_case, template

TITANIUM, LAW = Material(115e3, 0.29), EnergyLaw(1e-8)
ZERO = np.zeros(2)
TABLE = "P,Qx,My,Edx\n50,20,0,0\n50,-20,0,0\n"


def pad(name="pad"):
    return fretscale.ContactFace.nominal(name, (0.8, 1.0), lambda x, y: x**2 / 20.0, line=True)


def contact(method):
    return fretscale.Contact((64, 1), (TITANIUM,) * 2, (LAW, LAW), 0.6, method=method)


def history(P, Q, Ed=0.0):
    sliding = ZERO + Ed > 0.0
    return LoadHistory(ZERO + P, [Q, -Q], *[ZERO] * 4, ZERO + Ed, ZERO, sliding=sliding)


def test_a_model_wears_as_its_case(tmp_path):
    (tmp_path / "loads.csv").write_text(TABLE, encoding="utf-8")
    text = template("resultants").replace("dimension: 3", "dimension: 2")
    overrides = [
        *("structure.size=0.8", "structure.gap={shape: paraboloid, radius_x: 10}"),
        *("contact.grid=64", "friction.coefficient=0.6", "wear.cycles=2e3"),
        *("wear.step.cycles=1e3", "error_budget=known", "stress.section=none"),
        *("stress.life.parameter=none", "output={figures: false, paraview: false}"),
    ]
    case = parse_case(text, str(tmp_path / "case.yaml"), overrides)
    written = fretscale.run(case, tmp_path / "out", quiet=True)
    results, name = wear_model(case).run(), "interface"
    kinetics = written.summary["kinetics"][name]
    for body in (1, 2):
        assert results[name][f"volume_{body}"].values.tolist() == kinetics[f"volume_{body}"]
        assert results[name][f"largest_depth_{body}"].values.tolist() == kinetics[f"depth_{body}"]
    assert kinetics["volume_1"][-1] > 0.0


def test_the_half_space_finds_slips_that_are_not_given():
    """Cattaneo and Mindlin: c/a = sqrt(1 - Q/µP) sticks, beyond it the pad wears."""
    loads = fretscale.GivenLoads([(pad(), history(50.0, 20.0))])
    wear = fretscale.Wear(cycles=10.0, jump=fretscale.JumpSize(cycles=10.0))
    worn = fretscale.WearModel(loads, contact("full"), wear).run()["pad"]
    depth = worn["depth_2"].isel(cycles=-1).squeeze()
    pressure = worn["pressure"].isel(cycles=0).squeeze()
    half_width, cell = 0.5 * 0.8 * float((pressure > 0.0).mean()), 0.8 / 64
    unworn = (depth < 1e-6 * depth.max()) & (pressure > 0.0)
    stuck = 0.5 * cell * np.count_nonzero(unworn)
    assert stuck == pytest.approx(half_width * np.sqrt(1.0 - 20.0 / 30.0), abs=1.5 * cell)


def test_given_slips_wear_by_their_energy():
    """Both increments slide by 40 µm under µP = 30 N/mm."""
    slip = np.zeros((2, 2, 2))
    slip[0, 0], slip[1, 0] = 0.04, -0.04
    cycle = CycleLoads(history(50.0, -30.0, 1.2), slip)
    loads = fretscale.GivenLoads([(pad(), cycle)])
    worn = fretscale.WearModel(loads, contact("normal"), fretscale.Wear(cycles=100.0)).run()["pad"]
    assert worn["volume_2"].values[-1] == pytest.approx(1e-8 * 2.4 * 100.0, rel=1e-9)


def test_the_peak_is_that_of_the_heaviest_face():
    light, heavy = history(10.0, 1.0), LoadHistory([5.0, 20.0], *[ZERO] * 7, sliding=ZERO > 0.0)
    loads = fretscale.GivenLoads([(pad("one"), light), (pad("two"), heavy)])
    assert (loads.peak, loads.line) == (1, True)
    assert loads.user_faces(1) == ()
    np.testing.assert_array_equal(loads.probe([])[:, 0], [10.0, 20.0])


SLIP = np.zeros((2, 2, 2))
SLIP[:, 0] = [[0.02], [-0.02]]


class Own(fretscale.UncoupledSource):
    """A user's source of loads, of which some parts may be wrong."""

    line, peak = True, 0

    def __init__(self, **parts):
        self.__dict__ |= {"names": ("pad",), "loads": history(50.0, 20.0), "slip": SLIP} | parts

    @property
    def faces(self):
        return tuple(map(pad, self.names))

    def unworn(self):
        return (CycleLoads(self.loads, self.slip),) * len(self.names)


@pytest.mark.parametrize(
    "wrong",
    [
        {"peak": 2},
        {"peak": -1},
        {"line": False},
        {"names": ()},
        {"names": ("pad", "pad")},
        {"loads": history(-50.0, 20.0)},
        {"loads": history(np.nan, 20.0)},
        {"slip": np.zeros((2, 2, 5))},
    ],
)
def test_loads_of_a_user_fit_their_faces(wrong):
    """Without a check they would wear another face, another amount or nothing."""
    wear = fretscale.Wear(cycles=100.0)
    fretscale.WearModel(Own(), contact("normal"), wear).run()
    with pytest.raises(InputError):
        fretscale.WearModel(Own(**wrong), contact("normal"), wear).run()


def test_every_face_has_slips_where_they_wear_it():
    pairs = [(pad(), CycleLoads(history(50.0, 20.0), SLIP)), (pad("foot"), history(50.0, 20.0))]
    model = fretscale.WearModel(
        fretscale.GivenLoads(pairs), contact("normal"), fretscale.Wear(cycles=100.0)
    )
    with pytest.raises(InputError, match="foot has none"):
        model.run()


def test_shares_of_missions_add_up():
    cycle = history(50.0, 20.0)
    for wrong in ((0.9, 0.9), (-0.5, 1.5), (1.0,), (np.nan, 1.0)):
        with pytest.raises(InputError, match="shares"):
            LoadHistory.mix([cycle, cycle], wrong)


def test_a_face_has_one_history_of_loads():
    with pytest.raises(InputError, match="a ContactFace with its CycleLoads"):
        fretscale.GivenLoads([(pad(), history(50.0, 20.0), history(50.0, 20.0))])
