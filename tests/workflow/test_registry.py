"""A new analysis, or a new structure that wears, needs one edit outside its own files.

Both are made here and registered by one line each; the command line then knows them.
"""

import json
import math
import re
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, ClassVar, Literal

import h5py
import numpy as np
import pytest

from fe_models.meshes.structure_mesh import Face
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, Frame
from tests.workflow.command_line import invoke
from workflow import kinds
from workflow.analyses import wear
from workflow.analyses.wear import structures
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.sections import TwoMaterials, WearSection
from workflow.analyses.wear.run_time import Extent
from workflow.analyses.wear.structure import WearStructure
from workflow.case.fields import Quantity
from workflow.case.sections import Case, Length, Section, Stress, entry
from workflow.models.loads import ContactFace, UserFace
from workflow.shell.analysis import Analysis, Run
from workflow.shell.memory import Memory
from workflow.shell.output.summary import finish
from workflow.shell.run_time import RunTime

Force = Annotated[float, Quantity("N", above=0.0, at_most=1e6)]


def done(*arguments: object) -> str:
    """Return the output of a command that succeeds."""
    result = invoke(*arguments)
    assert result.exit_code == 0, result.stderr
    return result.stdout


# --- an analysis: the pressure between a sphere and a plane, by Hertz ----------------------------


class Ball(Section):
    """Sphere on a plane of the same material."""

    kind: Literal["ball"] = entry("what is pressed", "ball")
    radius: Length = entry("of the sphere [mm]", "10 mm")
    modulus: Stress = entry("E / (1 - ν²) of both [MPa]", "200 GPa")


class HertzCase(Case):
    """Ball pressed on a plane."""

    about: ClassVar[str] = "a ball pressed on a plane"

    analysis: Literal["hertz"] = entry("what is computed", "hertz")
    structure: Ball = entry("what is loaded")
    force: Force = entry("that presses [N]", "100 N")

    @property
    def question(self) -> str:
        return f"How wide is the contact? Load: {self.force:g} N."

    def outline(self) -> list[tuple[str, str]]:
        return [("structure", f"ball of {self.structure.radius:g} mm under {self.force:g} N")]


def run_hertz(run: Run[HertzCase]) -> None:
    """Compute the radius of the contact [mm], Johnson (1985), Contact Mechanics, eq. 4.22."""
    case = run.case
    run.reporter.say(f"run: {case.title}")
    combined = case.structure.modulus / 2.0
    radius = (0.75 * case.force * case.structure.radius / combined) ** (1.0 / 3.0)
    finish(run, {"contact": {"radius": radius}}, [f"radius {radius:.4g} mm"])


def no_memory(case: HertzCase) -> Memory:
    return Memory(0.0, "nothing is large")


HERTZ = Analysis(
    name="hertz",
    cases={"ball": HertzCase},
    run=run_hertz,
    memory=no_memory,
    run_time=lambda case: RunTime(),
)
# a³ = 3 F R / (4 E*): 100 N, 10 mm, E* = 100 GPa.
RADIUS = 0.0075 ** (1.0 / 3.0)


@pytest.fixture
def ball(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Register the analysis, and return a new case of it."""
    monkeypatch.setattr(kinds, "ANALYSES", {**kinds.ANALYSES, "hertz": "hertz"})
    monkeypatch.setitem(sys.modules, "workflow.analyses.hertz", SimpleNamespace(ANALYSIS=HERTZ))
    path = tmp_path / "ball.yaml"
    done("new", "ball", path)
    return path


def test_new_analysis_is_written_and_checked(ball: Path) -> None:
    assert re.search(r"radius: 10 mm +# of the sphere \[mm\]", ball.read_text("utf-8"))
    assert "ball of 10 mm under 100 N" in done("check", ball)
    assert re.search(r"\bball\b", done("new", "--help"))
    wrong = invoke("check", ball, "--set", "structure.radius=10 s")
    assert wrong.exit_code == 2
    assert "cannot be converted" in wrong.stderr


def test_new_analysis_is_in_the_schema(ball: Path) -> None:
    schema = json.loads(done("schema"))
    assert {"$ref": "#/$defs/HertzCase"} in schema["oneOf"]
    radius = schema["$defs"]["Ball"]["properties"]["radius"]
    assert radius["description"] == "of the sphere [mm]"


def test_new_analysis_runs_to_its_end(ball: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done("run", ball, "--out", out)
    assert "run: Ball on a flat" in (out / "run.log").read_text("utf-8")
    radius = json.loads((out / "summary.json").read_text("utf-8"))["contact"]["radius"]
    assert radius == pytest.approx(RADIUS, rel=1e-12)
    assert "finished; nothing to do" in done("resume", out)
    other = invoke("run", ball, "--out", out, "--set", "force=1 kN")
    assert (other.exit_code, "another case" in other.stderr) == (2, True)


def test_new_analysis_that_keeps_nothing_is_not_resumed(ball: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done("run", ball, "--out", out)
    (out / "summary.json").unlink()
    refused = invoke("resume", out)
    assert refused.exit_code == 2
    assert "cannot continue a half-done run; start it again with `fretscale run" in refused.stderr


@pytest.mark.parametrize(("value", "code", "verdict"), [(RADIUS, 0, "met"), (0.3, 1, "MISSED")])
def test_new_analysis_is_verified(ball, tmp_path, value, code, verdict):
    expected = (
        f"{{quantity: contact.radius, value: {value!r}, tolerance: 1e-9, kind: closed_form, "
        "source: Hertz}"
    )
    with ball.open("a", encoding="utf-8") as file:
        file.write(f"expect: [{expected}]\n")
    result = invoke("verify", ball, "--out", tmp_path / "verified")
    assert (result.exit_code, verdict in result.stdout) == (code, True)


def test_new_analysis_without_ladders_is_not_charted(ball: Path, tmp_path: Path) -> None:
    refused = invoke("chart", ball, "--out", tmp_path / "chart")
    assert refused.exit_code == 2
    assert "a case of this kind has nothing to chart" in refused.stderr


def test_new_analysis_has_no_structure_to_take_loads_from(ball: Path, tmp_path: Path) -> None:
    refused = invoke("resultants", ball, "--out", tmp_path / "loads")
    assert refused.exit_code == 2
    assert "no structure to take loads from" in refused.stderr


# --- a structure: a rounded stamp moved back and forth by a machine without resistance ------------

HALF_WIDTH = 1.0
INCREMENTS = 4


class Stamp(Section):
    """Stamp pressed by a constant force, whose foot is moved back and forth."""

    kind: Literal["stamp"] = entry("what the structure is", "stamp")
    radius: Length = entry("of its foot [mm]", "100 mm")
    force: Force = entry("that presses it [N]", "50 N")
    stroke: Length = entry("from end to end [mm]", "20 um")


class StampCase(WearCase):
    """Stamp that wears together with its support."""

    about: ClassVar[str] = "a stamp that wears with what it stands on"

    structure: Stamp = entry("what is loaded")
    materials: TwoMaterials = entry("the two bodies in contact")
    wear: WearSection = entry("law, length of the run and step")

    @property
    def loads_in_words(self) -> str:
        return f"{self.structure.force:g} N"

    def loads_outline(self) -> list[tuple[str, str]]:
        return [("structure", f"stamp under {self.structure.force:g} N")]


@dataclass(frozen=True)
class Sliding:
    """Loads of the rigid foot over a cycle: ``slip`` ``(t, 2, n)`` [mm]."""

    loads: LoadHistory
    slip: Array
    force: None = None
    displacement: None = None


def rounded(radius: float, x: Array, y: Array) -> Array:
    """Return the gap [mm] of a foot of this radius."""
    return (x**2 + y**2) / (2.0 * radius)


class StampLoads:
    """Loads of gross sliding in closed form, independent of wear."""

    line = False
    peak = 0
    slip_known = True

    def __init__(self, case: StampCase) -> None:
        self._case = case

    @property
    def faces(self) -> tuple[ContactFace, ...]:
        corners = HALF_WIDTH * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        facets = np.array([[0, 1, 2], [0, 2, 3]])
        face = Face("foot", Frame(np.zeros(3), np.eye(3)), corners, facets)
        size = 2.0 * HALF_WIDTH, 2.0 * HALF_WIDTH
        gap = partial(rounded, self._case.structure.radius)
        return (ContactFace(face, size, gap, (8, 8)),)

    def prepare(self) -> None:
        """Do nothing, since nothing is costly."""

    def unworn(self) -> tuple[Sliding, ...]:
        stamp, friction = self._case.structure, self._case.friction.coefficient
        motion = stamp.stroke * 2.0 / INCREMENTS * np.array([1.0, 1.0, -1.0, -1.0])
        zero = np.zeros(INCREMENTS)
        loads = LoadHistory(
            P=np.full(INCREMENTS, stamp.force),
            Qx=-friction * stamp.force * np.sign(motion),
            Qy=zero,
            Mx=zero,
            My=zero,
            Mz=zero,
            Edx=friction * stamp.force * np.abs(motion),
            Edy=zero,
            sliding=np.ones(INCREMENTS, dtype=bool),
        )
        slip = np.zeros((INCREMENTS, 2, 4))
        slip[:, 0] = motion[:, None]
        return (Sliding(loads, slip),)

    def worn(self, depths: object, friction: object = None) -> tuple[Sliding, ...]:
        return self.unworn()

    def user_faces(self, number: int) -> tuple[UserFace, ...]:
        return ()

    def probe(self, depths: object, friction: object = None) -> Array:
        return np.array([[self._case.structure.force, 0.0, 0.0, 0.0, 0.0, 0.0]])


STAMP = WearStructure(name="stamp", case=StampCase, model=StampLoads, extent=lambda case: Extent(2))
# Of a small run: two jumps, no stress below the contact.
SMALL = (
    *("contact.grid=[32, 32]", "wear.cycles=1e5", "wear.step.cycles=5e4", "stress.section=none"),
    *("stress.life.parameter=none", "output.figures=false", "output.paraview=false"),
)


@pytest.fixture
def stamp(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Register the structure, and return a new case of it."""
    monkeypatch.setattr(structures, "STRUCTURES", (*structures.STRUCTURES, STAMP))
    monkeypatch.setitem(wear.ANALYSIS.cases, STAMP.name, STAMP.case)
    path = tmp_path / "stamp.yaml"
    done("new", "stamp", path)
    return path


def test_new_structure_is_written_and_checked(stamp: Path) -> None:
    printed = done("check", stamp)
    assert "stamp under 50 N" in printed
    assert "300,000 cycles" in printed
    assert "StampCase" in done("schema")


def test_new_structure_wears_its_contact(stamp: Path, tmp_path: Path) -> None:
    """Both bodies wear by dissipated energy, so volume is coefficient times energy."""
    out = tmp_path / "out"
    settings = [part for override in SMALL for part in ("--set", override)]
    done("run", stamp, "--out", out, *settings)
    assert "100000 cycles in 2 jumps" in (out / "run.log").read_text("utf-8")
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    case = kinds.load_case(stamp, SMALL)
    assert isinstance(case, StampCase)
    per_cycle = 2.0 * case.structure.stroke * case.friction.coefficient * case.structure.force
    assert summary["foot"]["energy_per_cycle"]["structure"] == pytest.approx(per_cycle, rel=1e-12)
    for body in (1, 2):
        volume = case.wear_of(body).coefficient * per_cycle * case.wear.cycles
        assert volume > 0.0
        assert summary["foot"][f"volume_{body}"] == pytest.approx(volume, rel=1e-6)
    # Hertz, before any wear: p = 3 F / (2 π a²).
    young, poisson = case.materials.body_1.young, case.materials.body_1.poisson
    radius, force = case.structure.radius, case.structure.force
    combined = young / (1.0 - poisson**2) / 2.0
    a = (0.75 * force * radius / combined) ** (1.0 / 3.0)
    hertz = 1.5 * force / (math.pi * a**2)
    peaks = summary["foot"]["peak_pressure"]
    assert peaks["unworn"] == pytest.approx(hertz, rel=0.05)  # the grid
    assert peaks["worn"] < peaks["unworn"]
    with h5py.File(out / "results.h5") as file:
        assert file["kinetics/foot/volume_1"].attrs["unit"] == "mm^3"
    assert "finished; nothing to do" in done("resume", out)
