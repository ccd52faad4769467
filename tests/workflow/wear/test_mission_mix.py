"""Tests of alternating missions: in the structure, from a file, and in wear."""

from pathlib import Path

import numpy as np
import pytest

from sa_solver.load_history import LoadHistory
from tests.workflow.command_line import command
from tests.workflow.conftest import Run
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.structures.mesh.model import mesh_assembly
from workflow.analyses.wear.structures.resultants.reading import read_resultants
from workflow.analyses.wear.structures.resultants.writing import (
    write_resultants_csv,
    write_resultants_h5,
)
from workflow.case.files.input_files import InputFileError
from workflow.errors import CaseError
from workflow.kinds import load_case, parse_case, template
from workflow.models.structure import StructureLoads

COARSE = "mesh.flank_nodes=[11, 11]", "mesh.size=8", "contact.grid=[48, 64]"
QUIET = "output.paraview=false", "output.figures=false", "stress.section=none"
SHORT = ("load_path.increments=[3, 5]",)
LOW = "rotation_speed: 4500 rpm, aerodynamic_moment: 20 N*m"


def mix(*shares: float, last: str = "") -> str:
    """Return a mix of missions that differ in the last one."""
    blocks = [f"{{share: {share}}}" for share in shares[:-1]]
    return f"load_path.mix=[{', '.join([*blocks, f'{{share: {shares[-1]}, {last}}}'])}]"


@pytest.fixture(scope="module")
def plane_path(dovetail_path: Path) -> Path:
    return dovetail_path.with_name("dovetail_2d.yaml")


@pytest.fixture(scope="module")
def staged(plane_path):
    """Return a function for the structure of the plane dovetail with overrides."""

    def make(*overrides: str) -> StructureLoads:
        case = load_case(plane_path, [*COARSE, *SHORT, *overrides])
        source = loads_of(case)
        assert isinstance(source, StructureLoads)
        return source

    return make


@pytest.fixture(scope="module")
def run(plane_path, tmp_path_factory):
    """Return a function for a run of two explicit steps of the plane dovetail."""

    def go(*overrides: str) -> Run:
        steps = "wear.cycles=2000", "wear.step={kind: explicit, cycles: 1000}"
        settings = [*COARSE, *SHORT, *QUIET, *steps, *overrides]
        folder = tmp_path_factory.mktemp("mix") / "out"
        done = Run(command("run", plane_path, "--out", folder, overrides=settings), folder)
        assert done.ending.exit_code == 0, done.ending.stderr
        return done

    return go


# --- structure ------------------------------------------------------------------------------------


def test_blocks_of_a_mix_are_the_missions_one_after_the_other(staged):
    """Each is the closed cycle that it would be alone, worn and unworn."""
    mixed = staged(mix(0.7, 0.3, last=LOW))
    alone = staged(), staged("load_path.rotation_speed=4500 rpm",
                             "load_path.aerodynamic_moment=20 N*m")  # fmt: skip
    depths = [np.full(len(i), 1e-3) for i in mixed.mesh.interfaces]
    for whole, parts in (
        (mixed.unworn(), [stage.unworn() for stage in alone]),
        (mixed.worn(depths), [stage.worn(depths) for stage in alone]),
    ):
        for history, *separate in zip(whole, *parts, strict=True):
            assert history.loads.missions == [slice(0, 8), slice(8, 16)]
            assert history.loads.share.tolist() == [0.7] * 8 + [0.3] * 8
            for block, part in zip(history.loads.missions, separate, strict=True):
                np.testing.assert_array_equal(history.slip[block], part.slip)
                np.testing.assert_array_equal(history.loads.P[block], part.loads.P)
                np.testing.assert_array_equal(history.loads.Edx[block], part.loads.Edx)
    assert mixed.peak == 2
    np.testing.assert_array_equal(mixed.probe(depths), alone[0].probe(depths))


def test_peak_load_is_that_of_the_heaviest_mission(staged):
    stage = staged(mix(0.3, 0.7, last="rotation_speed: 7000 rpm"))
    assert stage.peak == 8 + 2
    loads = stage.unworn()[0].loads
    assert loads.P[stage.peak] == loads.P.max()


@pytest.mark.parametrize("friction", [0.25, 0.55])
def test_structural_friction_may_change_with_wear(staged, friction):
    """Loads equal those of a case with this coefficient, and the wedge's closed form at peak."""
    stage, other = staged(), staged(f"friction.coefficient={friction}")
    unworn = [np.zeros(len(i)) for i in stage.mesh.interfaces]
    changed = stage.worn(unworn, [friction] * 2)
    for history, expected in zip(changed, other.unworn(), strict=True):
        for name in ("P", "Qx"):
            computed, right = getattr(history.loads, name), getattr(expected.loads, name)
            np.testing.assert_allclose(computed, right, atol=1e-3 * expected.loads.P.max())
    probes = stage.probe(unworn, [friction] * 2), other.probe(unworn)
    np.testing.assert_allclose(*probes, atol=1e-4 * probes[1].max())
    P, Qx = (getattr(changed[0].loads, name)[stage.peak] for name in ("P", "Qx"))
    before = stage.unworn()[0].loads
    force = np.sqrt(2.0) * (before.P - before.Qx)[stage.peak]
    assert pytest.approx(force / np.sqrt(2.0) / (1.0 + friction), rel=1e-3) == P
    assert pytest.approx(-friction * P, rel=1e-3) == Qx


def test_flanks_may_differ_in_friction(staged):
    """The slippery one slides at its limit; together they carry the pull, Σ P - Qx at 45°."""
    stage = staged()
    unworn, t = [np.zeros(len(i)) for i in stage.mesh.interfaces], stage.peak
    both = sum(h.loads.P[t] - h.loads.Qx[t] for h in stage.unworn())
    loads = [h.loads for h in stage.worn(unworn, [0.35, 0.45])]
    assert sum(flank.P[t] - flank.Qx[t] for flank in loads) == pytest.approx(both, rel=1e-6)
    assert loads[0].sliding[t]
    assert loads[0].Qx[t] == pytest.approx(-0.35 * loads[0].P[t], rel=1e-4)
    assert not loads[1].sliding[t]
    assert 0.35 < -loads[1].Qx[t] / loads[1].P[t] < 0.45
    # Flanks are alike: with the coefficients changed over, so are the loads.
    mirrored = [h.loads for h in stage.worn(unworn, [0.45, 0.35])]
    for flank, other in zip(loads, mirrored[::-1], strict=True):
        np.testing.assert_allclose(flank.P, other.P, atol=1e-4 * flank.P.max())


def test_factors_of_a_mix_scale_the_loads_of_a_mesh(template_files):
    """The factor of a rotation applies to its speed, and forces follow the square."""
    path = template_files / "case.yaml"
    turning = "{kind: rotation, axis: [0, 1, 0], through: [0, 0, 0], speed: 10, path: [1, 0]}"
    overrides = [
        "load_path.mix=[{share: 0.6, factors: [1, 1]}, {share: 0.4, factors: [0.5, 0.5]}]",
        "structure.loads=[{kind: pressure, group: blade_top, pressure: 10, path: [1, 0]}, "
        f"{turning}]",
    ]
    first, second = mesh_assembly(parse_case(template("mesh"), str(path), overrides)).load_cycles
    assert (first.share, second.share) == (0.6, 0.4)
    np.testing.assert_allclose(second.amplitudes, first.amplitudes * [0.5, 0.25], rtol=1e-14)
    with pytest.raises(CaseError, match=r"load_path\.mix\.0\.factors: 2"):
        parse_case(template("mesh"), str(path), overrides[:1])


# --- runs -----------------------------------------------------------------------------------------

# What a summary says of a face that no share may change where missions are the same.
ALIKE = "depth_1", "depth_2", "volume_1", "volume_2", "energy", "slip_per_cycle"


def summaries(done: Run) -> list[dict]:
    return [done.summary[name] for name in ("intrados", "extrados")]


@pytest.fixture(scope="module")
def alone(run) -> Run:
    return run()


@pytest.mark.slow
@pytest.mark.parametrize(
    "entries",
    [mix(0.3, 0.7), mix(1.0, 0.0, last=LOW)],
    ids=["the same twice", "one that never happens"],
)
def test_a_mix_of_one_mission_wears_as_that_one(run, alone, entries):
    for mixed, single in zip(summaries(run(entries)), summaries(alone), strict=True):
        for key in ALIKE:
            assert mixed[key] == pytest.approx(single[key], rel=1e-10), key
        for key, value in single["energy_per_cycle"].items():
            assert mixed["energy_per_cycle"][key] == pytest.approx(value, rel=1e-10)
        ruiz = "stress", "friction_parameter", "disk", "worn", "value"
        one, two = mixed, single
        for key in ruiz:
            one, two = one[key], two[key]
        assert one == pytest.approx(two, rel=1e-8)


@pytest.mark.slow
def test_two_missions_wear_by_their_mean_energy(run, alone):
    low = run("load_path.rotation_speed=4500 rpm", "load_path.aerodynamic_moment=20 N*m")
    mixed = run(mix(0.7, 0.3, last=LOW))
    for flank, *parts in zip(summaries(mixed), summaries(alone), summaries(low), strict=True):
        assert flank["volume_1"] == pytest.approx(1e-8 * flank["energy"], rel=1e-10)
        for key, value in flank["energy_per_cycle"].items():
            first, second = (part["energy_per_cycle"][key] for part in parts)
            assert value == pytest.approx(0.7 * first + 0.3 * second, rel=1e-8), key


@pytest.mark.slow
def test_friction_that_wear_raises_moves_the_load(run):
    """From µ 0.4 to 0.5 in the first step: the wedge then takes P = F / 2 (sin θ + µ cos θ)."""
    raised = run("friction.evolution={energy: [0, 1], factor: [1, 1.25]}")
    assert raised.summary["structure"]["solutions"] > 1
    for flank in summaries(raised):
        unworn, worn = (flank["peak_load"][moment] for moment in ("unworn", "worn"))
        assert worn["P"] == pytest.approx(1.4 / 1.5 * unworn["P"], rel=1e-3)
        assert worn["Qx"] == pytest.approx(-0.5 * worn["P"], rel=2e-3)
        assert flank["volume_1"] == pytest.approx(1e-8 * flank["energy"], rel=1e-10)


# --- files ----------------------------------------------------------------------------------------


def mixed_loads() -> LoadHistory:
    zero = np.zeros(3)
    P = np.array([100.0, 200.0, 0.0])
    mission = LoadHistory(P, -0.1 * P, zero, zero, zero, zero, 0.01 * P, zero, P > 1e3)
    return LoadHistory.mix([mission, mission], (0.7, 0.3))


def test_csv_of_a_mix_reads_back_bit_for_bit(tmp_path):
    loads = mixed_loads()
    write_resultants_csv(tmp_path / "loads.csv", {"a": loads, "b": loads})
    for imported in read_resultants(tmp_path / "loads.csv").values():
        for name, column in vars(loads).items():
            np.testing.assert_array_equal(getattr(imported.loads, name), column)


def test_hdf5_of_a_mix_reads_back_bit_for_bit(tmp_path, staged):
    stage = staged(mix(0.7, 0.3, last=LOW))
    histories = {history.interface.name: history for history in stage.unworn()}
    write_resultants_h5(tmp_path / "loads.h5", histories)
    for name, imported in read_resultants(tmp_path / "loads.h5", line=True).items():
        for column in ("P", "share", "block", "sliding"):
            np.testing.assert_array_equal(
                getattr(imported.loads, column), getattr(histories[name].loads, column)
            )


def test_exported_mix_and_laws_are_a_case(plane_path, staged, tmp_path):
    """`fretscale resultants` exports both laws, their evolution and the mix."""
    entries = [
        *(*COARSE, *SHORT, mix(0.7, 0.3, last=LOW)),
        "wear.disk={law: archard, coefficient: 1e-4, hardness: 3 GPa}",
        "wear.blade.evolution={scope: local, energy: [0, 10 J/mm^2], factor: [1, 0.3]}",
        "friction.evolution={energy: [0, 1 kJ], factor: [1, 1.1]}",
    ]
    assert command("resultants", plane_path, "--out", tmp_path, overrides=entries).exit_code == 0
    given, read = load_case(plane_path, entries), load_case(tmp_path / "resultants.yaml")
    assert read.friction == given.friction
    for number in (1, 2):
        assert read.wear_of(number) == given.wear_of(number)
    expected = staged(mix(0.7, 0.3, last=LOW)).unworn()
    for imported, history in zip(read.loads().values(), expected, strict=True):
        assert imported.loads.mean_energy == pytest.approx(history.loads.mean_energy, rel=1e-12)


HEADER = "P, Qx, Qy, Mx, My, Mz, Edx, Edy, block, share [%]\n"


@pytest.mark.parametrize(
    ("rows", "named"),
    [
        ([(1, 70), (1, 70), (2, 20)], "0.9"),
        ([(1, 70), (2, 30), (1, 70)], "block"),
        ([(1, 70), (1, 60), (2, 30)], "share"),
    ],
)
def test_blocks_that_are_no_mix_are_refused(tmp_path, rows, named):
    table = "".join(f"100, 0, 0, 0, 0, 0, 0, 0, {block}, {share}\n" for block, share in rows)
    (tmp_path / "loads.csv").write_text(HEADER + table, encoding="utf-8")
    with pytest.raises(InputFileError, match=named):
        read_resultants(tmp_path / "loads.csv")


def test_interfaces_go_through_the_same_mix(tmp_path):
    rows = ["a, 1, 1, 0.5", "a, 1, 2, 0.5", "b, 1, 1, 0.4", "b, 1, 2, 0.6"]
    text = "interface, P, block, share, Qx, Qy, Mx, My, Mz, Edx, Edy\n"
    text += "".join(f"{row}, 0, 0, 0, 0, 0, 0, 0\n" for row in rows)
    (tmp_path / "loads.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputFileError, match="b and a differ"):
        read_resultants(tmp_path / "loads.csv")
