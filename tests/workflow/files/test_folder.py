"""Tests of the output folder: its owner, and refusals."""

import json

import pytest

from workflow.case.text.writing import dump_case
from workflow.errors import UserError
from workflow.kinds import load_case
from workflow.shell.folders.folder import OutputFolder


@pytest.fixture
def case(small_path):
    return load_case(small_path)


@pytest.fixture
def folder(tmp_path):
    return OutputFolder(tmp_path / "out")


def files(folder):
    return sorted(str(path.relative_to(folder.root)) for path in folder.root.rglob("*"))


def make(folder, *names):
    """Make entries as a run does."""
    for name in names:
        folder.reserve(name, "a test").write_text("old")


def test_claim_makes_the_folder_and_records_the_case(case, folder):
    folder.claim(case, force=False, resumable=True)
    assert files(folder) == ["case.yaml", "jumps", "manifest.json"]
    assert set(folder.manifest) == {"case.yaml", "checkpoint.h5", "jumps"}
    assert load_case(folder.case) == case


def test_claim_removes_only_what_the_earlier_run_wrote(case, folder):
    folder.claim(case, force=False, resumable=True)
    make(folder, "summary.json", "results.h5", "worn.msh", "loops_left.csv")
    folder.jump(1).write_text("old")
    with folder.filling("figures", "a test") as figures:
        (figures / "below").mkdir(parents=True)
        for name in ("loops.png", "below/state.vti"):
            (figures / name).write_text("old")
    for name in ("notes.txt", "loops_mine.csv"):
        (folder.root / name).write_text("mine")
    (folder.root / ".results.h5.123.part.h5").write_text("old")
    (folder.jumps / ".00002.h5.123.part.h5").write_text("old")
    (folder.jumps / "choice.json").write_text("{}")
    assert folder.claim(case, force=False, resumable=True) == []
    assert files(folder) == ["case.yaml", "jumps", "loops_mine.csv", "manifest.json", "notes.txt"]


@pytest.mark.parametrize("force", [False, True])
def test_own_files_in_the_folders_of_a_run_stay(case, folder, force):
    folder.claim(case, force=False, resumable=True)
    folder.jump(1).write_text("old")
    with folder.filling("figures", "a test") as figures:
        (figures / "loops.png").write_text("old")
    for mine in (figures / "mine.png", folder.jumps / "mine.txt"):
        mine.write_text("mine")
    folder.claim(case, force=force, resumable=True)
    folder.reserve("figures", "a test")
    assert files(folder) == [
        *("case.yaml", "figures.aside", "figures.aside/mine.png"),
        *("jumps", "jumps.aside", "jumps.aside/mine.txt", "manifest.json"),
    ]


def test_what_links_lead_to_stays(case, folder, tmp_path):
    """Links lead to a file, a folder that looks like a run's, and partial files, all outside."""
    folder.claim(case, force=False, resumable=True)
    with folder.filling("figures", "a test") as figures:
        (figures / "loops.png").write_text("old")
    make(folder, "results.h5")
    outside = tmp_path / "outside"
    folder.jumps.rename(outside)
    folder.jumps.symlink_to(outside)
    figures.rename(outside / "figures")
    figures.symlink_to(outside / "figures")
    (folder.root / "mine").symlink_to(outside)
    for name in ("00001.h5", ".x.h5.1.part.h5", "mine.h5"):
        (outside / name).write_text("mine")
    folder.results.unlink()
    folder.results.symlink_to(outside / "mine.h5")
    before = sorted(outside.rglob("*"))
    folder.clear_partial()
    folder.claim(case, force=True, resumable=True)
    assert sorted(outside.rglob("*")) == before
    assert not folder.results.is_symlink()
    assert not folder.jumps.is_symlink()


def test_a_manifest_leads_nowhere_else(case, folder):
    folder.claim(case, force=False, resumable=False)
    outside = folder.root.parent / "outside"
    outside.mkdir()
    (folder.root / ".hidden").touch()
    names = ["case.yaml", "../outside", "a/../../outside", str(outside), "", ".", "..", ".hidden"]
    listed = {"fretscale": {"run": dict.fromkeys(names, "")}}
    (folder.root / "manifest.json").write_text(json.dumps(listed))
    folder.claim(case, force=False, resumable=False)
    assert outside.exists()
    assert files(folder) == [".hidden", "case.yaml", "manifest.json"]


def older(folder, case):
    folder.root.mkdir()
    for name in ("summary.json", "results.h5", "worn.msh"):
        (folder.root / name).write_text("old")
    folder.case.write_text(dump_case(case))


def foreign(folder, case):
    folder.root.mkdir()
    (folder.root / "thesis.tex").write_text("mine")


def other(folder, case):
    folder.claim(case, force=False, resumable=False)
    folder.case.write_text(dump_case(case) + "# other\n")


def unfinished(folder, case):
    folder.claim(case, force=False, resumable=True)
    folder.checkpoint.touch()


OLDER = ["case.yaml", "results.h5", "summary.json", "worn.msh"]


@pytest.mark.parametrize(
    ("prepare", "words", "stays", "aside"),
    [
        (foreign, "no run of fretscale", ["thesis.tex"], []),
        (older, "no run of fretscale", OLDER, ["case.yaml", "summary.json"]),
        (other, "another case", [], []),
        (unfinished, "fretscale resume", [], []),
    ],
)
def test_what_is_refused_and_what_force_takes(case, folder, prepare, words, stays, aside):
    """Without a manifest nothing is removed: files in the way are renamed."""
    prepare(folder, case)
    before = files(folder)
    with pytest.raises(UserError, match=words) as refusal:
        folder.claim(case, force=False, resumable=True)
    assert "\n" not in str(refusal.value)
    assert files(folder) == before
    assert folder.claim(case, force=True, resumable=True) == stays
    kept = [f"{name}.aside" if name in aside else name for name in stays]
    assert files(folder) == sorted(["case.yaml", "jumps", "manifest.json", *kept])


@pytest.mark.parametrize("finished", [False, True])
def test_a_run_of_its_own_stays_until_the_case_is_finished(case, folder, finished):
    """An example is the wear of a joint, which takes longest."""
    folder.claim(case, force=False, resumable=False)
    nested = OutputFolder(folder.reserve("wear", "a test"))
    nested.claim(case, force=False, resumable=True)
    if finished:
        make(folder, "summary.json")
    folder.claim(case, force=False, resumable=False)
    assert nested.case.exists() is not finished
    assert ("wear" in folder.manifest) is not finished


@pytest.mark.slow
def test_a_run_warns_of_files_that_it_did_not_write(start, tmp_path):
    (tmp_path / "worn.msh").write_text("mine")
    run = start(tmp_path, "wear.cycles=1e4", "contact.grid=[16, 24]", force=True)
    assert run.ending.exit_code == 0
    assert "worn.msh: in the folder before this run" in run.summary["warnings"][0]
    assert (tmp_path / "worn.msh.aside").read_text() == "mine"


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_out_that_is_no_folder_is_one_line(start, tmp_path, place):
    (tmp_path / "file").write_text("mine")
    run = start(tmp_path / place)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert line.startswith(f"fretscale: {tmp_path}/file")
    assert (tmp_path / "file").read_text() == "mine"


def test_resume_of_no_run_is_one_line(resume, tmp_path):
    run = resume(tmp_path)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert "no run of fretscale here" in line


def test_resume_of_a_finished_run_does_nothing(whole, resume):
    before = {path: path.stat().st_mtime_ns for path in whole.folder.rglob("*")}
    run = resume(whole.folder)
    assert run.ending.exit_code == 0
    assert "finished" in run.ending.stdout
    assert {path: path.stat().st_mtime_ns for path in whole.folder.rglob("*")} == before
