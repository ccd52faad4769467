"""Each argument of each model refuses what it cannot be, in one line with its name."""

from dataclasses import replace

import fretscale
import numpy as np
import pytest
from skfem import MeshTet

from fe_models import Body, ElasticBody, FrettingConditions
from fe_models.dynamics import HarmonicForce, Link, Resolution, TimeStepControl, lumped_rig
from fe_models.geometry import Specimen
from sa_solver import ElasticPair, Grid, InputError, Layer, LoadHistory, Material
from wear import CellNodes, EnergyLaw, ImplicitStepper, InterfaceSettings
from wear.joints import Jenkins, JointEvolution
from workflow.models.loops import TangentialLoops

STEEL, LAW, ZERO = Material(200e3, 0.3, density=7.8e-9), EnergyLaw(1e-8), np.zeros(2)
NONSENSE = {
    "None": None,
    "text": "x",
    "NaN": np.nan,
    "negative": -1.0,
    "empty list": [],
    "empty array": np.zeros(0),
    "zeros": np.zeros(3),
    "object": object(),
    "flag": True,
    "infinite": np.inf,
}


def gap(x, y):
    return (x**2 + y**2) / 20.0


def mass():
    return lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]])


def rig():
    return fretscale.RigModel.of(mass(), driven={"m": 1.0}, observed=["m"])


def contact():
    return fretscale.Contact((24, 24), (STEEL,) * 2, (LAW, LAW), friction=0.6)


def ball():
    loads = fretscale.LoadTable.stroke(P=50.0, stroke=0.02)
    return fretscale.BodyPair(gap, size=(0.6, 0.6), loads=loads)


def joint():
    return fretscale.wear_model("cases/dovetail_2d.yaml").structure


def specimens():
    return fretscale.SpecimenPair(Specimen(pad_elements=4), (STEEL, STEEL), size=4.0)


def history():
    return LoadHistory([50.0, 50.0], [20.0, -20.0], *[ZERO] * 6, sliding=ZERO > 0.0)


def pad(name="pad"):
    return fretscale.ContactFace.nominal(name, (0.8, 0.8), gap)


JENKINS = Jenkins(stiffness=1e3, friction=0.5, normal_load=20.0)
# How each model is made, and which of the nonsense is right for an argument.
MODELS = {
    "Contact": (
        fretscale.Contact,
        lambda: {
            "grid": (24, 24),
            "bodies": (STEEL, STEEL),
            "laws": (LAW, LAW),
            "friction": 0.6,
            "method": "normal",
            "link": "corrected",
            "gross_slip": "force",
            "tolerance": 1e-8,
        },
        {},
    ),
    "Wear": (
        fretscale.Wear,
        lambda: {
            "cycles": 100.0,
            "steps": "implicit",
            "tolerance": 0.01,
            "jump": fretscale.JumpSize(),
            "stop": fretscale.Stop(),
            "resultants": "drift",
            "drift": 0.02,
            "motion": "auto",
        },
        {},
    ),
    "Stress": (
        fretscale.Stress,
        lambda: {
            "section": "x",
            "at": 0.0,
            "depth": 2.0,
            "points": 8,
            "parameter": "ruiz",
            "critical_distance": 0.02,
            "sensitivity": 0.3,
        },
        {"section": ["text"], "at": ["negative"]},
    ),
    "AddedGap": (fretscale.AddedGap, lambda: {"over": gap}, {}),
    "ContactFace.nominal": (
        fretscale.ContactFace.nominal,
        lambda: {"name": "pad", "size": (0.8, 0.8), "gap": gap, "line": False},
        {"name": ["text"], "line": ["flag"]},
    ),
    "LoadHistory": (
        LoadHistory,
        lambda: vars(history()) | {"share": np.ones(2), "block": np.zeros(2, dtype=np.int64)},
        dict.fromkeys(("share", "block"), tuple(NONSENSE)),
    ),
    "GivenLoads": (
        fretscale.GivenLoads,
        lambda: {"pairs": [(pad(), history())], "user_nodes": ()},
        {"user_nodes": ["empty list"]},
    ),
    "LoadTable": (fretscale.LoadTable, lambda: {"columns": {"P": [50.0, 50.0]}}, {}),
    "LoadTable.stroke": (
        fretscale.LoadTable.stroke,
        lambda: {"P": 50.0, "stroke": 0.02, "increments": 4, "direction": 0.0},
        dict.fromkeys(("P", "stroke", "direction"), ("negative",)),
    ),
    "LoadTable.legs": (
        fretscale.LoadTable.legs,
        lambda: {"targets": {"P": (50.0, 50.0)}, "increments": (2, 2), "closed": True},
        {"closed": ["flag"]},
    ),
    "BodyPair": (
        fretscale.BodyPair,
        lambda: vars(ball()) | {"peak": 1},
        {"name": ["text"], "remedy": ["text"], "line": ["flag"], "peak": ["None"]},
    ),
    "WearModel": (
        fretscale.WearModel,
        lambda: {"structure": ball(), "contacts": contact(), "wear": fretscale.Wear(100.0)},
        {},
    ),
    "Mission": (
        fretscale.Mission,
        lambda: vars(joint().missions[0]),
        {"aerodynamic_moment": ["negative"]},
    ),
    "DovetailMesh": (fretscale.DovetailMesh, lambda: vars(fretscale.DovetailMesh()), {}),
    "DovetailJoint": (fretscale.DovetailJoint, lambda: vars(joint()), {"finer": ["text"]}),
    "LegPath": (
        fretscale.LegPath,
        lambda: {
            "increments": (2, 4),
            "factors": ((1.0, 1.0),),
            "cycle_from": 1,
            "peak_leg": 2,
            "mix": (((1.0,), 1.0),),
        },
        {"mix": ["empty list"]},
    ),
    "TightenedBolt": (
        fretscale.TightenedBolt,
        lambda: {"load": 0, "name": "bolt", "force": 1e4},
        {"name": ["text"], "force": ["None"]},
    ),
    "SpecimenPair": (
        fretscale.SpecimenPair,
        lambda: vars(specimens()),
        dict.fromkeys(("added", "target_distance"), ("None",)),
    ),
    "FrettedSpecimens": (
        fretscale.FrettedSpecimens,
        lambda: {
            "specimens": specimens(),
            "conditions": FrettingConditions(60.0, 0.014, 0.88),
            "laws": (LAW, LAW),
            "cycles": 1e4,
        },
        {},
    ),
    "FrequencySweep": (
        fretscale.FrequencySweep,
        lambda: vars(fretscale.FrequencySweep(140.0, 250.0)),
        {"upward": ["flag"], "accuracy": ["None"]},
    ),
    "VibrationModel": (
        fretscale.VibrationModel,
        lambda: {
            "rig": rig(),
            "law": JENKINS,
            "forces": (100.0,),
            "sweep": fretscale.FrequencySweep(140.0, 250.0),
            "resolution": Resolution((1, 3), 64),
            "driving": None,
            "normal_load": 0.0,
        },
        {"driving": ["None"]},
    ),
    "RigModel.of": (
        fretscale.RigModel.of,
        lambda: {"model": mass(), "driven": {"m": 1.0}, "observed": ["m"], "directions": 1},
        {},
    ),
    "MotionModel": (
        fretscale.MotionModel,
        lambda: {
            "rig": rig(),
            "law": JENKINS,
            "force": HarmonicForce(np.ones(1), 100.0, 50.0),
            "duration": 0.05,
            "control": TimeStepControl(2e-4),
            "start": None,
        },
        {"start": ["None"]},
    ),
    "WearingJoint": (
        fretscale.WearingJoint,
        lambda: {
            "law": JENKINS,
            "evolution": JointEvolution(),
            "stroke": 0.02,
            "cycles": 1e3,
            "tolerance": 1e-4,
        },
        {},
    ),
    "TangentialLoops": (
        TangentialLoops,
        lambda: {"amplitude": 0.01, "axis": "x", "increments": 12, "every": "jump"},
        {"axis": ["text"]},
    ),
}


@pytest.mark.parametrize("model", MODELS)
def test_nonsense_is_refused_where_it_is_given(model):
    build, arguments, right = MODELS[model]
    given = arguments()
    build(**given)
    for name in given:
        for kind, value in NONSENSE.items():
            if kind in right.get(name, ()):
                continue
            with pytest.raises(fretscale.FretscaleError) as refused:
                build(**given | {name: value})
            assert "\n" not in str(refused.value), (name, kind)


@pytest.mark.parametrize("name", ["", " ", "a/b", ".", "..", "drift", "bodies", 5, None])
def test_a_face_has_a_name_that_results_can_have(name):
    with pytest.raises(fretscale.FretscaleError, match="contact face is called"):
        pad(name)
    with pytest.raises(fretscale.FretscaleError, match="contact face is called"):
        replace(ball(), name=name)


@pytest.mark.parametrize(
    "endless",
    [
        lambda: fretscale.Wear(cycles=100.0, jump=fretscale.JumpSize(cycles=1e-9)),
        lambda: fretscale.MotionModel(**MODELS["MotionModel"][1]() | {"duration": 1e9}),
        lambda: fretscale.Stress(points=10**9),
        lambda: replace(contact(), grid=(10**5, 10**5)),
        lambda: fretscale.LoadTable.stroke(P=50.0, stroke=0.02, increments=10**9),
        lambda: fretscale.WearModel(
            ball(), contact(), fretscale.Wear(100.0, jump=fretscale.JumpSize(depth=1e-300))
        ).run(),
        lambda: fretscale.WearModel(
            ball(), contact(), fretscale.Wear(1e9, steps="explicit", fraction=1e-9)
        ).run(),
        lambda: fretscale.WearModel(
            replace(ball(), loads=fretscale.LoadTable.stroke(P=50.0, stroke=1e9)),
            contact(),
            fretscale.Wear(100.0),
        ).run(),
    ],
)
def test_runs_without_end_are_refused(endless):
    with pytest.raises(fretscale.FretscaleError, match=r"at most|more than|give \d"):
        endless()


def test_observers_are_given_in_a_list():
    model = fretscale.WearModel(ball(), contact(), fretscale.Wear(100.0))
    motion = fretscale.MotionModel(**MODELS["MotionModel"][1]())
    vibration = fretscale.VibrationModel(**MODELS["VibrationModel"][1]())
    for run in (model.run, motion.run, vibration.run):
        for wrong in (fretscale.Progress(), "x", [None], 5):
            with pytest.raises(fretscale.FretscaleError, match="observers"):
                run(wrong)


def test_resultants_are_numbers():
    for name in ("P", "Mx", "Edy"):
        wrong = LoadHistory(**vars(history()) | {name: [50.0, np.nan]})
        with pytest.raises(fretscale.FretscaleError, match="NaN"):
            fretscale.GivenLoads([(pad(), wrong)])


def test_layers_are_refused_where_they_would_be_left_out():
    coated = replace(STEEL, layers=(Layer(0.05, 20e3, 0.3),))
    with pytest.raises(InputError, match="layers"):
        fretscale.Contact((24, 24), (STEEL, coated), (LAW, LAW), friction=0.6)
    with pytest.raises(InputError, match="layers"):
        contact_of_settings(coated)
    with pytest.raises(InputError, match="layers"):
        ElasticBody(Body("cube", MeshTet()), coated)


def contact_of_settings(body):
    grid = Grid.line_contact(1.4, 70)
    return InterfaceSettings(
        name="cylinder",
        grid=grid,
        gap=grid.x**2 / 20.0,
        transfer=CellNodes(grid),
        pair=ElasticPair(STEEL, body),
        laws=(LAW, LAW),
        friction=lambda energy: 0.5,
        stepper=ImplicitStepper(),
    )
