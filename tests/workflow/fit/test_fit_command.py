"""Tests of ``fretscale fit``: tables become a section of a case; wrong input gives one line."""

import json

import fretscale
import numpy as np
import pytest
from ruamel.yaml import YAML

from tests.conftest import CASES
from tests.workflow.case.test_templates import ways
from tests.workflow.command_line import invoke
from wear.joints import UniformIwan, march_joints
from workflow.fit.schema import load_fit
from workflow.fit.section import rounded
from workflow.fit.template import FITS, fit_template
from workflow.kinds import parse_case
from workflow.messages.warning_kinds import WarningKind

JOINT = """\
title: Friction rig, test 1
fit: joint_evolution
measurements: [{file: loops.csv}]
law: bouc_wen
joint: {normal_load: 60 N}
evolution:
  friction: {kind: logarithmic}
  stiffness: {kind: arrhenius}
  residual_stiffness: {kind: linear}
"""
WEAR = """\
title: Tests 3 to 5
fit: wear_coefficient
measurements: [{file: volumes.csv}]
wear: {law: energy, offset: intercept}
"""
# Fantetti et al. 2019, table 3.1, tests 3 to 5, and a fourth of 4000 J on the line of the others.
VOLUMES = "energy [J], volume [mm^3]\n500, 3.2e-3\n2900, 7.3e-3\n4000, 8.5e-3\n7100, 12.7e-3\n"


def loops_csv():
    """Write the three functions of Fantetti et al. 2019, table 4.2, as loops have them."""
    energy = np.concatenate([[0.0], np.geomspace(0.1, 2800.0, 25)])
    with np.errstate(divide="ignore"):
        kt = 27.3 * (1.0 + 1.32 * np.exp(-150.0 / energy))
    mu = 0.11 * (1.0 + 0.26 * np.log(1.3e9 * energy + 1.0))
    kr = 0.88 * (1.0 + 0.24e-3 * energy)
    rows = [
        ", ".join(f"{value:.12g}" for value in row) for row in zip(energy, mu, kt, kr, strict=True)
    ]
    return "\n".join(["energy [J], mu, kt [N/um], residual_stiffness [N/um]", *rows, ""])


@pytest.fixture
def folder(tmp_path):
    for name, text in (
        ("loops.csv", loops_csv()),
        ("joint.yaml", JOINT),
        ("volumes.csv", VOLUMES),
        ("wear.yaml", WEAR),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_printed_parameters_come_back_as_a_section_to_paste(folder):
    done = invoke("fit", folder / "joint.yaml", "--out", folder / "out")
    assert (done.exit_code, done.stderr) == (0, "")
    plain = YAML(typ="safe", pure=True)
    shipped = (CASES / "rig_bouc_wen.yaml").read_text("utf-8")
    section = plain.load((folder / "out" / "section.yaml").read_text("utf-8"))
    pasted = plain.load(shipped) | section
    case = parse_case(json.dumps(pasted), str(CASES / "pasted.yaml"))
    original = parse_case(shipped, str(CASES / "rig_bouc_wen.yaml"))
    for part in ("joint", "evolution"):
        known = getattr(original, part).model_dump()
        found = getattr(case, part).model_dump()
        assert leaves(found) == pytest.approx(leaves(known), rel=1e-6)
    summary = json.loads((folder / "out" / "summary.json").read_text("utf-8"))
    rate = summary["parameters"]["evolution.friction.rate"]
    assert (rate["unit"], rate["value"]) == ("1/J", pytest.approx(1.3e9, rel=1e-6))
    assert rate["shares"]["friction"] == pytest.approx(1.0)
    assert (folder / "out" / "fit.png").read_bytes().startswith(b"\x89PNG")
    again = invoke("fit", folder / "joint.yaml", "--out", folder / "out")
    assert again.exit_code == 2
    assert "--force" in again.stderr


def test_friction_is_of_loops_that_slide(folder):
    """In a loop that sticks, force over load is less than the coefficient of friction."""
    slides = ["sliding", *("1" if k != 5 else "0.3" for k in range(26))]
    lines = [f"{a}, {b}" for a, b in zip(loops_csv().splitlines(), slides, strict=True)]
    energy, mu, rest = lines[6].split(", ", 2)
    lines[6] = f"{energy}, {0.5 * float(mu):g}, {rest}"
    (folder / "loops.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    found = fretscale.fit(folder / "joint.yaml")
    assert found["joint.friction"].value == pytest.approx(0.11, rel=1e-6)
    (caveat,) = (caveat for caveat in found.plausibility_warnings if caveat.startswith("mu: "))
    assert "loops.csv:7" in caveat
    assert WarningKind.DATA_LEFT_OUT.code in caveat
    text = "\n".join([lines[0], *(line.rpartition(",")[0] + ", 0.5" for line in lines[1:]), ""])
    (folder / "loops.csv").write_text(text, encoding="utf-8")
    refused = invoke("fit", folder / "joint.yaml")
    assert refused.exit_code == 2
    assert "mu: no loop slides as a whole (column sliding)" in refused.stderr


def leaves(node, path=""):
    """Return the numbers of a section by path."""
    if isinstance(node, dict):
        found = [leaves(value, f"{path}.{key}") for key, value in node.items()]
        return {name: number for part in found for name, number in part.items()}
    return {path: node} if isinstance(node, float) else {}


def test_volumes_of_two_bodies_have_coefficients_of_their_own(folder):
    rows = "".join(f"{1000 * k}, {1e-3 * k + 1e-5 * (-1) ** k}, {2e-3 * k}\n" for k in range(1, 6))
    (folder / "volumes.csv").write_text(f"energy [J], volume_1 [mm^3], volume_2 [mm^3]\n{rows}")
    found = fretscale.fit(folder / "wear.yaml")
    assert found["wear.body_2.coefficient"].value == pytest.approx(2000.0)
    assert found["wear.body_1.coefficient"].value == pytest.approx(1000.0, rel=0.01)
    section = YAML(typ="safe", pure=True).load(found.section)["wear"]
    assert section["body_2"] == {"coefficient": "2000 um^3/J"}


def test_what_is_not_determined_stands_without_a_number(folder):
    """Without loops of the unworn joint, two of three parameters of the logarithm are found."""
    text = "".join(line for line in loops_csv().splitlines(True) if not line.startswith("0,"))
    (folder / "loops.csv").write_text(text, encoding="utf-8")
    found = fretscale.fit(folder / "joint.yaml")
    friction = found["joint.friction"]
    assert (friction.value, friction.lower) == (None, None)
    assert "only together with evolution.friction.change" in friction.caveat
    assert "# friction: undetermined" in found.section
    # With the initial value held the rest is found.
    held = JOINT.replace("{normal_load: 60 N}", "{normal_load: 60 N, friction: 0.11}")
    (folder / "held.yaml").write_text(held, encoding="utf-8")
    rate = fretscale.fit(folder / "held.yaml")["evolution.friction.rate"]
    assert rate.value == pytest.approx(1.3e9, rel=1e-6)


def test_a_law_comes_back_from_a_record_of_loops(folder):
    law = UniformIwan(60e3, 0.9, 60.0, 1.4e3)
    motion = 7e-3 * np.sin(2.0 * np.pi * np.arange(2401) / 600)
    record = march_joints(law, law.rest(1), np.zeros((1, 1)), motion[:, None, None])
    rows = [f"{1e3 * x:.9g}, {f:.9g}" for x, f in zip(motion, record.force.ravel(), strict=True)]
    (folder / "loop.csv").write_text("\n".join(["displacement [um], force [N]", *rows]))
    asked = {
        "title": "As new",
        "fit": "joint_law",
        "measurements": [{"file": str(folder / "loop.csv")}],
        "joint": {"law": "uniform_iwan", "normal_load": "60 N"},
    }
    found = fretscale.fit(asked, folder / "out")
    assert found["joint.stiffness"].value == pytest.approx(60.0, rel=1e-3)
    assert found["joint.friction"].value == pytest.approx(0.9, rel=1e-4)
    section = YAML(typ="safe", pure=True).load(found.section)["joint"]
    assert (section["law"], section["normal_load"]) == ("uniform_iwan", "60 N")
    # Of load and friction only the product counts, and no number is given for either.
    asked["joint"]["normal_load"] = "free"
    found = fretscale.fit(asked)
    assert found["joint.friction"].caveat == "only its product with joint.normal_load counts"
    (product,) = [
        caveat for caveat in found.plausibility_warnings if " times joint.normal_load is " in caveat
    ]
    assert float(product.partition(" is ")[2].split()[0]) == pytest.approx(54.0, rel=1e-4)
    assert found["joint.stiffness"].value == pytest.approx(60.0, rel=1e-3)
    del asked["joint"]["normal_load"]
    with pytest.raises(fretscale.UserError, match="no normal load"):
        fretscale.fit(asked)


def test_a_joint_that_wears_within_a_record_gives_a_warning(folder):
    law = UniformIwan(60e3, 0.9, 60.0, 1.4e3)
    motion = 7e-3 * np.sin(2.0 * np.pi * np.arange(161) / 40)
    force = march_joints(law, law.rest(1), np.zeros((1, 1)), motion[:, None, None]).force.ravel()
    force *= np.linspace(1.0, 1.3, len(force))
    rows = [f"{1e3 * x:.9g}, {f:.9g}" for x, f in zip(motion, force, strict=True)]
    (folder / "loop.csv").write_text("\n".join(["displacement, force", "um, N", *rows]))
    found = fretscale.fit(
        {
            "title": "Wears",
            "fit": "joint_law",
            "measurements": [{"file": str(folder / "loop.csv")}],
            "joint": {"law": "uniform_iwan", "normal_load": "60 N"},
        }
    )
    assert any("loops of one stroke change" in caveat for caveat in found.plausibility_warnings)
    assert "closed loops of" in str(found)


def test_residual_stiffness_is_subtracted_for_laws_with_a_spring(folder):
    text = JOINT.replace("law: bouc_wen", "law: jenkins")
    (folder / "joint.yaml").write_text(text, encoding="utf-8")
    found = fretscale.fit(folder / "joint.yaml")
    assert found["joint.stiffness"].value == pytest.approx(27.3 - 0.88, rel=0.01)


@pytest.mark.parametrize(
    ("file", "old", "new", "named"),
    [
        ("loops.csv", "kt [N/um]", "kt [MPa]", "loops.csv:1: kt"),
        ("loops.csv", "\n0.1,", "\n0.9,", "loops.csv:4: energy"),
        ("loops.csv", " mu,", " friction,", "mu"),
        ("joint.yaml", "bouc_wen", "iwan", "law"),
        ("joint.yaml", "loops.csv}", "loops.csv, columns: {mu: f}}", "f"),
        ("joint.yaml", "linear}", "linear}\nshared: [second_rate]", "shared"),
        ("wear.yaml", "law: energy,", "law: energy_amplitude,", "reference_amplitude"),
        ("volumes.csv", "\n2900, 7.3e-3\n4000, 8.5e-3", "", "2 values"),
        ("loops.csv", "energy [J]", "energy", "loops.csv:1: 'energy'"),
    ],
)
def test_wrong_measurements_are_refused_with_their_place(folder, file, old, new, named):
    text = (folder / file).read_text("utf-8")
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1), encoding="utf-8")
    asked = "joint.yaml" if file in ("loops.csv", "joint.yaml") else "wear.yaml"
    done = invoke("fit", folder / asked)
    assert (done.exit_code, done.stderr.count("\n")) == (2, 1), done.stderr
    assert named in done.stderr


def test_files_of_two_materials_give_warnings(folder):
    rng = np.random.default_rng(0)
    for name, alpha in (("a", 1.0e-6), ("b", 1.8e-6)):
        rows = [f"{e}, {alpha * e + 2e-5 * rng.standard_normal()}" for e in range(500, 6000, 500)]
        text = "\n".join(["energy [J], volume [mm^3]", *rows])
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    found = fretscale.fit(
        {
            "title": "Mixed up",
            "fit": "wear_coefficient",
            "measurements": [{"file": str(folder / f"{name}.csv")} for name in "ab"],
            "wear": {"law": "energy"},
        }
    )
    assert any(
        "two groups" in caveat and "b.csv:2" in caveat for caveat in found.plausibility_warnings
    )
    assert any("files lie apart" in caveat for caveat in found.plausibility_warnings)
    (apart,) = [
        caveat for caveat in found.plausibility_warnings if "contradict each other" in caveat
    ]
    assert apart.startswith("wear.both.coefficient: ")
    tests = found.summary["tests"]["wear.both.coefficient"]
    assert [one["file"] for one in tests["files"]] == ["a.csv", "b.csv"]
    assert [one["own"] for one in tests["files"]] == pytest.approx([1000.0, 1800.0], rel=0.01)
    assert [one["share"] for one in tests["files"]] == [0.5, 0.5]
    assert "wear.both.coefficient by file: a.csv 50 % (alone " in str(found)


@pytest.mark.parametrize("kind", FITS)
def test_every_comment_of_a_template_may_be_opened(folder, kind):
    (folder / "measured.csv").write_text(loops_csv(), encoding="utf-8")
    (folder / "test.yaml").write_text("a case, which is read when it is run", encoding="utf-8")
    file, seen = folder / "template.yaml", set()
    file.write_text(fit_template(kind), encoding="utf-8")
    load_fit(file)
    for key, text, _ in ways(fit_template(kind), seen):
        if key == "wear.reference_amplitude":
            text = text.replace("law: energy ", "law: energy_amplitude ")
        file.write_text(text, encoding="utf-8")
        load_fit(file)
    assert len(seen) == {"fit_joint": 9, "fit_loops": 5, "fit_wear": 3, "fit_profiles": 3}[kind]


@pytest.mark.parametrize(
    ("value", "deviation", "text"),
    [(1422.04, 110.2, "1420"), (0.00031243, 7.4e-6, "3.124e-4"), (-0.5, 0.1234, "-0.50")],
)
def test_numbers_have_two_digits_of_their_deviation(value, deviation, text):
    assert rounded(value, deviation) == text
