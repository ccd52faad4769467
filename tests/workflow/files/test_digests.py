"""Changed files, and finished runs with changed files, are detected and not used."""

import random
import shutil

import h5py
import numpy as np
import pytest

from fe_models.joints.joint import JointResolvent
from tests.workflow.command_line import invoke
from tests.workflow.scenes import ROLLER_LOADS, ROLLER_WEAR
from workflow.case.sections import files_of
from workflow.errors import UserError
from workflow.kinds import load_case
from workflow.messages.warning_kinds import WarningKind
from workflow.runs.provenance import provenance_of
from workflow.runs.run import bring_to_end, resume_run, stored_run
from workflow.shell.folders import cache
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.store import DamagedFile, read_arrays, write_arrays

# --- files of arrays ------------------------------------------------------------------------------


def kept(path):
    write_arrays(path, {"pressure": np.arange(12.0), "left/slip": np.ones((3, 2))}, {"cycles": 4.0})
    return path


def test_arrays_come_back(tmp_path):
    arrays, attributes = read_arrays(kept(tmp_path / "jump.h5"))
    np.testing.assert_array_equal(arrays["pressure"], np.arange(12.0))
    np.testing.assert_array_equal(arrays["left/slip"], 1.0)
    assert attributes == {"cycles": 4.0}
    with h5py.File(tmp_path / "jump.h5") as file:
        assert set(file) == {"pressure", "left"}


def test_no_bit_can_change(tmp_path):
    """A change in numbers, names, attributes, structure or digest is detected."""
    path, dice = kept(tmp_path / "jump.h5"), random.Random(12)
    whole = path.read_bytes()
    digest, rest = range(8 * 64), range(8 * 512, 8 * len(whole))
    for bit in (*dice.sample(digest, 50), *dice.sample(rest, 500)):
        content = bytearray(whole)
        content[bit // 8] ^= 1 << bit % 8
        path.write_bytes(content)
        with pytest.raises(DamagedFile, match=r"jump\.h5: damaged"):
            read_arrays(path)


@pytest.mark.parametrize("length", [0, 3, 64, 512, 513, 2000])
def test_no_file_can_be_shorter(tmp_path, length):
    path = kept(tmp_path / "jump.h5")
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(DamagedFile):
        read_arrays(path)


# --- the cache ------------------------------------------------------------------------------------


def joint(rho):
    return JointResolvent(inverse=np.eye(3), rho=rho, loads=np.ones((3, 1)), rigid_modes=0)


def joint_file(folder, name):
    return folder / f"joint-{cache.content_key(name)}.h5"


def stored(key, rho):
    """Return rho of the joint of a key, and whether it was stored; make it if it was not."""
    found, known = cache.DiskStore().joint(key, lambda: joint(rho))
    return found.rho, known


def doubled(path):
    with h5py.File(path, "r+") as file:
        file["inverse"][0, 0] *= 2.0


def lacking(path):
    with h5py.File(path, "r+") as file:
        del file["loads"]


def flipped(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def anothers(path):
    stored(("another",), 3.0)
    shutil.copy(joint_file(path.parent, "another"), path)


@pytest.mark.parametrize("damage", [doubled, lacking, flipped, anothers])
def test_what_is_damaged_in_the_cache_is_not_there(damage, tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path))
    assert stored(("key",), 2.0) == (2.0, False)
    assert not caplog.messages
    assert stored(("key",), 9.0) == (2.0, True)
    path = joint_file(tmp_path, "key")
    damage(path)
    assert stored(("key",), 4.0) == (4.0, False)
    (logged,) = caplog.messages
    assert logged.startswith(f"cache: {path}: damaged")
    assert WarningKind.DAMAGED_CACHE.code in logged
    assert stored(("key",), 9.0) == (4.0, True)


@pytest.mark.slow
def test_a_run_with_a_damaged_cache_finds_the_same(start, whole, tmp_path, monkeypatch):
    own = tmp_path / "cache"  # that of the session holds the bodies of other tests
    monkeypatch.setenv("FRETSCALE_CACHE", str(own))
    start(tmp_path / "first")
    damaged = 0
    for path in own.glob("*.h5"):
        with h5py.File(path, "r+") as file:
            name = "loads" if "loads" in file else "displacement"
            if name in file:
                file[name][...] *= 1.5
                damaged += 1
    run = start(tmp_path / "out")
    assert run.summary["kinetics"] == whole.summary["kinetics"]
    assert not run.summary["structure"]["from_cache"]
    log = (run.folder / "run.log").read_text("utf-8")
    # The joint, the halves of both bodies, and the cycle.
    assert log.count("damaged: it differs from what was written; computed again") == damaged == 6


# --- finished runs --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return a wear case of loads from a file, and its run, which tests must not change."""
    root = tmp_path_factory.mktemp("finished")
    (root / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    once = ROLLER_WEAR.replace("  cycles: 4e4", "  cycles: 1e4")
    (root / "wear.yaml").write_text(once, encoding="utf-8")
    bring_to_end(load_case(root / "wear.yaml"), root / "out")
    return root


@pytest.fixture
def left(finished, tmp_path):
    """Return a copy of the run and its case; the file of loads is shared."""
    shutil.copytree(finished / "out", tmp_path / "out")
    return tmp_path / "out", load_case(finished / "wear.yaml")


def swap(path, one, other):
    content = path.read_bytes()
    assert one in content
    path.write_bytes(content.replace(one, other, 1))


def depth_in_summary(out):
    swap(out / "summary.json", b'"depth_1": 6', b'"depth_1": 7')


def bit_in_results(out):
    flipped(out / "results.h5")


DAMAGES = [(depth_in_summary, "summary.json"), (bit_in_results, "results.h5")]


@pytest.mark.parametrize(("damage", "wrong"), DAMAGES)
def test_finished_run_that_was_changed_is_computed_again(left, finished, damage, wrong):
    out, case = left
    assert stored_run(out, case) == "finished"
    damage(out)
    assert stored_run(out, case) == "nothing"
    with pytest.raises(UserError, match=wrong):
        resume_run(out)
    assert bring_to_end(case, out)
    assert (out / "results.h5").read_bytes() == (finished / "out/results.h5").read_bytes()


def test_finished_run_of_other_files_is_computed_again(finished, left):
    out, case = left
    loads = finished / "loads.csv"
    before = loads.read_bytes()
    try:
        swap(loads, b"400, 150, 0, 3\n", b"400, 150, 0, 4\n")
        assert stored_run(out, case) == "nothing"
        with pytest.raises(UserError, match=r"loads\.csv: differs from the run"):
            resume_run(out)
    finally:
        loads.write_bytes(before)
    assert stored_run(out, case) == "finished"


def test_finished_run_whose_case_was_changed_is_not_its_run(left, finished):
    """The run does not belong to the changed case, and that case is not finished either."""
    out, case = left
    swap(out / "case.yaml", b"coefficient: 0.4 ", b"coefficient: 0.6 ")
    assert stored_run(out, case) == "other"
    other = load_case(finished / "wear.yaml", ("friction.coefficient=0.6",))
    assert stored_run(out, other) == "nothing"
    with pytest.raises(UserError, match=r"case\.yaml: differs from the run"):
        resume_run(out)


# --- the files of a case --------------------------------------------------------------------------


def test_files_are_found_in_cases_that_cases_name(finished, tmp_path):
    """A joint that follows the wear of a contact depends on the loads of that contact."""
    wear, loads = finished / "with_loops.yaml", finished / "loads.csv"
    wear.write_text(ROLLER_WEAR + "loops: {amplitude: 1 um}\n", encoding="utf-8")
    invoke("new", "joint", tmp_path / "joint.yaml")
    joint = load_case(tmp_path / "joint.yaml", (f"evolution={{file: {wear}}}",))
    folder = OutputFolder(tmp_path / "out")
    folder.claim(joint, force=False, resumable=False)
    assert list(files_of(joint)) == [str(wear)]
    assert list(files_of(load_case(wear))) == [str(loads)]
    assert provenance_of(folder, joint)["input_files"].keys() == {str(wear), str(loads)}
