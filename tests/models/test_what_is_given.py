"""Models refuse settings without a meaning, and warn of implausible ones."""

import warnings
from dataclasses import replace

import fretscale
import numpy as np
import pytest

from fe_models.geometry import Specimen
from sa_solver import InputError, LoadHistory, Material
from tests.marks import slow
from wear import ArchardLaw, CycleLoads, EnergyLaw
from wear.evolution import CoulombFriction, EnergyTable
from workflow.messages.warning_kinds import WarningKind

TITANIUM, LAW = Material(115e3, 0.29), EnergyLaw(1e-8)
STROKE = fretscale.LoadTable.stroke(P=50.0, stroke=0.02)


def gap(x, y):
    return (x**2 + y**2) / 20.0


def contact(**changed):
    given = {"grid": (32, 32), "bodies": (TITANIUM,) * 2, "laws": (LAW, LAW), "friction": 0.6}
    return fretscale.Contact(**given | changed)


def ball(**changed):
    return fretscale.BodyPair(**{"gap": gap, "size": (0.6, 0.6), "loads": STROKE} | changed)


def model(structure=None, of=None, wear=None):
    wear = wear or fretscale.Wear(cycles=100.0)
    return fretscale.WearModel(structure or ball(), of or contact(), wear)


def pad(name="pad", line=True):
    return fretscale.ContactFace.nominal(name, (0.8, 0.8), lambda x, y: x**2 / 20.0, line=line)


def history(P=(50.0, 50.0)):
    zero = np.zeros(len(P))
    return LoadHistory(np.array(P), *[zero] * 7, sliding=zero > 0.0)


@pytest.mark.parametrize(
    "refused",
    [
        lambda: contact(bodies=(TITANIUM,)),
        lambda: contact(bodies=TITANIUM),
        lambda: contact(laws=(LAW, None)),
        lambda: contact(friction=None),
        lambda: contact(tolerance=1.0),
        lambda: EnergyLaw(None),
        lambda: ArchardLaw(1e-4, None),
        lambda: fretscale.Wear(cycles=0.0),
        lambda: fretscale.Wear(cycles=None),
        lambda: fretscale.Wear(cycles=10.0, jump=5.0),
        lambda: fretscale.Wear(cycles=10.0, stop=5.0),
        lambda: fretscale.Wear(cycles=10.0, fraction=0.5),
        lambda: fretscale.Wear(cycles=10.0, steps="explicit"),
        lambda: fretscale.Wear(
            cycles=10.0, steps="explicit", fraction=0.5, jump=fretscale.JumpSize(cycles=1.0)
        ),
        lambda: model(of=[contact()]),
        lambda: model(wear=100.0),
        lambda: replace(model(), stress=True),
        lambda: fretscale.SpecimenPair(Specimen(), (TITANIUM,) * 2),
        lambda: fretscale.SpecimenPair(Specimen(), (replace(TITANIUM, density=4e-9),) * 2, order=3),
    ],
)
def test_settings_without_a_meaning_are_refused(refused):
    with pytest.raises(InputError):
        refused()


@pytest.mark.parametrize(
    "refused",
    [
        lambda: fretscale.LoadTable({"P": [], "shift_x": []}),
        lambda: fretscale.LoadTable.stroke(P=50.0, stroke=0.02, increments=0),
        lambda: fretscale.LoadTable.stroke(P=50.0, stroke=0.02, increments=2.5),
        lambda: fretscale.LoadTable.legs({"P": (50.0, 50.0)}, (-1, 2)),
        lambda: ball(loads=None),
        lambda: ball(loads=fretscale.LoadTable({"P": [50.0, -1.0], "shift_x": [0.01, 0.0]})),
        lambda: ball(gap=10.0),
        lambda: ball(peak=len(STROKE)),
        lambda: model(ball(gap=lambda x, y: gap(x, y)[:5])).run(),
        lambda: model(ball(loads=fretscale.LoadTable({"P": [50.0], "shift_x": [0.01]}))).run(),
        lambda: fretscale.GivenLoads([]),
        lambda: fretscale.GivenLoads([(pad(), history()), (pad(), history())]),
        lambda: fretscale.GivenLoads([(pad(), history()), (pad("foot", line=False), history())]),
        lambda: fretscale.GivenLoads([(pad(), history()), (pad("foot"), history([50.0]))]),
        lambda: fretscale.GivenLoads([(pad(), history([50.0, -50.0]))]),
        lambda: fretscale.GivenLoads([(pad(), CycleLoads(history(), np.zeros((2, 2, 9))))]),
        lambda: model(fretscale.GivenLoads([(pad(), history())])).run(),
    ],
)
def test_loads_without_a_meaning_are_refused(refused):
    with pytest.raises(InputError):
        refused()


def test_an_observer_is_given_in_a_list():
    with pytest.raises(InputError, match="give a list"):
        model().run(fretscale.Progress())


@pytest.mark.parametrize("cells", [(32, 1), (32, 8)])
def test_a_contact_of_few_cells_is_warned_of(cells):
    with pytest.warns(fretscale.ModelWarning, match=WarningKind.FEW_CELLS.code):
        model(of=contact(grid=cells)).run()


@pytest.mark.parametrize(
    ("changed", "wear", "warning"),
    [
        ({"bodies": (replace(TITANIUM, yield_stress=100.0),) * 2}, {}, "above the yield stress"),
        ({"bodies": (TITANIUM, Material(210e3, 0.3))}, {}, "Dundurs' beta"),
        ({"friction": 50.0}, {}, "coefficient of friction is 50"),
        (
            {},
            {"cycles": 1e6, "steps": "explicit", "jump": fretscale.JumpSize(cycles=5e5)},
            "amplify the roughness",
        ),
        ({}, {"steps": "explicit", "fraction": 5.0}, "5 times their stability limit"),
        ({}, {"cycles": 1e6}, "touches the border"),
    ],
)
def test_implausible_models_are_warned_of(changed, wear, warning):
    """The last one wears up to the border of its grid: its first cycle does not reach it."""
    settings = fretscale.Wear(**{"cycles": 100.0} | wear)
    with pytest.warns(fretscale.ModelWarning, match=warning):
        model(of=contact(**changed), wear=settings).run()


@pytest.mark.parametrize("last", [0.01, 0.0])
def test_friction_that_falls_within_a_cycle_is_warned_of(last):
    """While µ falls from 0.6 to 0.6 times ``last``, 1 N mm is dissipated; a cycle begins at 1.2."""
    falling = CoulombFriction(0.6, EnergyTable((0.0, 1.0), (1.0, last)))
    with pytest.warns(fretscale.ModelWarning, match="within the first cycle"):
        model(of=contact(grid=(16, 16), friction=falling)).run()


@pytest.mark.parametrize("last", [0.5, slow(0.0)])
def test_friction_that_falls_within_a_jump_is_followed(last):
    """With e' = µ(e) P s: e = (1 - exp(-k N)) / c until the table ends, and a straight line then.

    The first 10 N mm of 100 cycles change friction; a cycle dissipates 1.2 N mm at first.
    """
    falling = CoulombFriction(0.6, EnergyTable((0.0, 10.0), (1.0, last)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        worn = model(of=contact(grid=(16, 16), friction=falling)).run()["interface"]
    slope, begun = (1.0 - last) / 10.0, 0.6 * 50.0 * 0.04
    ends = -np.log(last) / (slope * begun) if last else np.inf
    energy = (1.0 - np.exp(-slope * begun * min(ends, 100.0))) / slope
    if last:
        energy += last * begun * (100.0 - ends)
    assert worn["energy"].values[-1] == pytest.approx(energy, rel=5e-3)
    volume = worn["volume_1"].values[-1]
    assert volume == pytest.approx(1e-8 * worn["energy"].values[-1], rel=1e-9)


def test_a_plausible_model_is_not_warned_of():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model().run()


class Whole:
    """A user's wear law that forgets the cells."""

    def depth_per_pressure(self, sliding):
        return np.float64(1e-8)


def test_a_wear_law_returns_a_depth_for_every_cell():
    with pytest.raises(InputError, match="Whole returns depths per pressure of shape"):
        model(of=contact(laws=(Whole(), LAW))).run()


def test_a_contact_of_one_point_is_refused():
    with pytest.raises(InputError, match="meaningless"):
        model(ball(size=(6.0, 6.0))).run()


def joint():
    return fretscale.wear_model("cases/dovetail_2d.yaml").structure


@pytest.mark.parametrize(
    "changed",
    [
        {"increments": 0},
        {"increments": 8, "peak_at": 8},
        {"peak_at": 0},
        {"rotation_speed": 0.0},
        {"airfoil_mass": -1e-3},
        {"airfoil_mass": None},
    ],
)
def test_a_mission_rises_to_its_peak_and_falls(changed):
    with pytest.raises(InputError):
        replace(joint().missions[0], **changed)


@pytest.mark.parametrize(
    "changed",
    [{"shares": (-1.0,)}, {"shares": (0.5,)}, {"sides": "free"}],
)
def test_a_joint_has_all_of_its_missions_and_sides(changed):
    with pytest.raises(InputError):
        replace(joint(), **changed)


@pytest.mark.parametrize(
    "changed",
    [{"flank_angle": 45.0}, {"flank_angle": 0.0}, {"skew": 10.0}, {"flank_length": -8.0}],
)
def test_a_dovetail_that_cannot_be_drawn_is_refused(changed):
    """Angles are in radians: 45 would be drawn as another angle."""
    with pytest.raises(fretscale.FretscaleError):
        replace(joint().geometry, **changed)


@pytest.mark.parametrize(("body", "name"), [("disk", "the disk"), ("blade", "the blade")])
def test_a_body_without_mass_is_warned_of(body, name):
    """Its own centrifugal load is missing."""
    massless = replace(joint(), **{body: replace(TITANIUM, density=0.0)})
    remarks = [remark.text for remark in massless.remarks(None, [0.1]) if remark.kind is not None]
    assert len(remarks) == 1
    assert remarks[0].startswith(f"{name} has no density")


def test_elements_are_of_order_1_or_2():
    with pytest.raises(InputError):
        fretscale.DovetailMesh(order=3)
    for nodes in ((20, 27), (21, 34)):  # an element of order 2 has three nodes on an edge
        with pytest.raises(InputError):
            fretscale.DovetailMesh(nodes)


def test_a_checkpoint_is_a_file_in_a_folder(tmp_path):
    for path in (tmp_path, tmp_path / "missing" / "state.h5"):
        with pytest.raises(fretscale.UserError):
            fretscale.Checkpoint(path)


def test_a_state_beyond_the_end_is_refused(tmp_path):
    checkpoint = fretscale.Checkpoint(tmp_path / "state.h5")
    model().run([checkpoint])
    with pytest.raises(InputError, match="cycles"):
        model(wear=fretscale.Wear(cycles=50.0)).run(start=checkpoint.state())
