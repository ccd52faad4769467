"""Tests of one sector of a ring, against all sectors assembled here; and of refusals."""

import csv

import h5py
import numpy as np
import pytest

from tests.conftest import CASES
from tests.workflow.output.figure_checks import problems_of_run
from tests.workflow.vibration.time_scenes import run
from workflow.errors import CaseError
from workflow.kinds import parse_case

SECTORS, ORDER, STIFF, AT = 7, 3, 4e3, 250.0
TURN = 2.0 * np.pi / SECTORS
RIM = f"""\
title: A rim of rods, cut through its joints
analysis: vibration
structure:
  kind: matrices
  matrices: {{file: rim.npz, unknowns: unknowns.csv, units: {{length: mm, force: N}}}}
  joints: [{{points: next middle, against: middle, direction: x}}]
  damping_ratio: 0.02
  driven: {{points: middle, direction: y}}
  seen: {{points: middle, direction: x}}
ring: {{sectors: {SECTORS}, axis: z, faces: [{{points: right, next_points: left}}]}}
joint: {{law: jenkins, normal_load: 100 N, friction: 10, stiffness: {STIFF} N/mm}}
engine_order: {ORDER}
forces: [1 N]
at: [{AT} Hz]
frequencies: [245 Hz, 255 Hz]
resolution: {{harmonics: 1, samples: 64}}
output: {{report: false, paraview: false}}
"""
BLADES = (CASES / "ring_of_blades.yaml").read_text(encoding="utf-8").partition("expect:")[0]


def node(number):
    """Return the position of a rim node, two per sector; the cut ones bulge."""
    radius = 100.0 if number % 2 == 0 else 90.0
    return radius * np.array([np.cos(0.5 * number * TURN), np.sin(0.5 * number * TURN)])


def rods(ends, count, held):
    """Return the stiffness of rods between nodes, by number and place, and of all supports."""
    stiffness = np.kron(np.diag(held), 300.0 * np.eye(2))
    for one, other in ends:
        along = node(other) - node(one)
        row = np.zeros(2 * count)
        for number, sign in ((one, -1.0), (other, 1.0)):
            place = 2 * (number % count)
            row[place : place + 2] = sign * along / np.linalg.norm(along)
        stiffness += 2e3 * np.outer(row, row)
    return stiffness


@pytest.fixture
def rim(tmp_path):
    """Return a folder with the matrices of a sector, and the matrices of the whole ring."""
    np.savez(
        tmp_path / "rim.npz",
        K=rods([(0, 1), (1, 2)], 3, [0.5, 1.0, 0.5]),
        M=np.kron(np.diag([0.5, 1.0, 0.5]), 1e-3 * np.eye(2)),
    )
    rows = [f"{point},{axis}" for point in ("left", "middle", "right") for axis in "xy"]
    (tmp_path / "unknowns.csv").write_text("\n".join(["point,direction", *rows]), encoding="utf-8")
    count = 2 * SECTORS
    return tmp_path, rods([(i, i + 1) for i in range(count)], count, np.ones(count))


def test_a_sector_between_cut_faces_moves_as_in_the_whole_ring(rim):
    """Natural frequencies and a forced motion agree in fixed axes with stuck joints."""
    folder, stiffness = rim
    summary = run(folder, RIM)
    every = np.sqrt(np.linalg.eigvalsh(stiffness / 1e-3)) / (2.0 * np.pi)
    with h5py.File(folder / "out" / "results.h5") as file:
        group = file["nodal_diameters"]
        assert group["diameters"][()].tolist() == [0, 1, 2, 3]
        # Those of other numbers than 0 twice.
        found = np.vstack([group["free"][()], group["free"][1:]])
        harmonics = file["responses/00000/harmonics/at_00000"]
        moved = dict(zip(file["names/places"][()], harmonics["displacement"][0], strict=True))
        np.testing.assert_allclose(group["free"][ORDER], summary["free"], rtol=1e-12)
    np.testing.assert_allclose(np.sort(found.ravel()), every, rtol=1e-9)
    squares, shapes = np.linalg.eigh(stiffness / 1e-3)
    damping = 1e-3 * (shapes * (0.04 * np.sqrt(squares))) @ shapes.T
    force = np.zeros(4 * SECTORS, dtype=complex)
    for sector in range(SECTORS):
        angle = sector * TURN
        x, y = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        middle, after = 4 * sector + 2, (4 * sector + 6) % (4 * SECTORS)
        row = np.zeros(4 * SECTORS)
        row[middle : middle + 2], row[after : after + 2] = -x, x
        stiffness = stiffness + STIFF * np.outer(row, row)
        force[middle : middle + 2] = -1j * np.exp(-1j * ORDER * angle) * y
    turning = 2.0 * np.pi * AT
    answer = np.linalg.solve(
        stiffness + 1j * turning * damping - 1e-3 * turning**2 * np.eye(28), force
    )
    for name, place in ((b"left x", 0), (b"left y", 1), (b"middle x", 2), (b"middle y", 3)):
        assert moved[name] == pytest.approx(answer[place], rel=1e-8)
    assert summary["responses"][0]["nodal_diameters"] == [ORDER]


def test_responses_have_the_nodal_diameters_of_their_harmonics(tmp_path):
    few = ("forces=[10 N]", "frequencies=[1050 Hz, 1180 Hz]", "resolution.harmonics=3")
    summary = run(tmp_path, BLADES, *few, "ring.sectors=6", "stability=every")
    (response,) = summary["responses"]
    assert response["harmonics"] == [1, 3, 5]
    # 4, 12 and 20 of 6.
    assert response["nodal_diameters"] == [-2, 0, 2]
    assert response["speed"] == pytest.approx(2.0 * np.pi * response["resonance"] / 4.0)
    # All sectors are looked at, of which each has two modes.
    assert response["unknown_points"] < response["points"]
    assert (tmp_path / "out" / "figures" / "nodal_diameters.png").exists()
    assert problems_of_run(tmp_path / "out") == []
    with (tmp_path / "out" / "nodal_diameters.csv").open(encoding="utf-8") as file:
        assert [float(row["diameters [1]"]) for row in csv.DictReader(file)] == [0.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        (["engine_order="], "engine_order"),
        (["engine_order=2.5"], "engine_order"),
        (["ring.axis="], "ring.axis"),
        (["ring.sectors=1"], "ring.sectors"),
        (["structure.points.0.name=blade"], "structure.points"),
    ],
)
def test_wrong_rings_are_refused(tmp_path, settings, named):
    with pytest.raises(CaseError, match=named):
        parse_case(BLADES, str(tmp_path / "case.yaml"), settings)
