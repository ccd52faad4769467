"""The output folder: whose it is, and what is refused."""

import pytest

from workflow.case.writing import dump_case
from workflow.errors import UserError
from workflow.kinds import load_case
from workflow.shell.folder import OutputFolder


@pytest.fixture
def case(small_path):
    return load_case(small_path)


@pytest.fixture
def folder(tmp_path):
    return OutputFolder(tmp_path / "out")


def files(folder):
    return sorted(str(path.relative_to(folder.root)) for path in folder.root.rglob("*"))


def test_claim_makes_the_folder_and_records_the_case(case, folder):
    folder.claim(case, force=False, resumable=True)
    assert files(folder) == ["case.yaml", "jumps"]
    assert load_case(folder.case) == case


def test_claim_removes_only_what_a_run_writes(case, folder):
    folder.claim(case, force=False, resumable=True)
    for name in ("summary.json", "results.h5", "worn.msh", "jumps/00001.h5", "notes.txt"):
        (folder.root / name).write_text("old")
    (folder.root / ".results.h5.123.part").write_text("old")
    (folder.jumps / ".00002.h5.123.part").write_text("old")
    folder.claim(case, force=False, resumable=True)
    assert files(folder) == ["case.yaml", "jumps", "notes.txt"]


@pytest.mark.parametrize(
    ("prepare", "words"),
    [
        (lambda root, text: (root / "thesis.tex").write_text("x"), "no run of fretscale"),
        (lambda root, text: (root / "case.yaml").write_text(text + "# other\n"), "another case"),
        (
            lambda root, text: [
                (root / "case.yaml").write_text(text),
                (root / "checkpoint.h5").touch(),
            ],
            "fretscale resume",
        ),
    ],
    ids=["foreign", "another case", "unfinished"],
)
def test_what_is_refused_and_what_force_takes(case, folder, prepare, words):
    folder.root.mkdir()
    prepare(folder.root, dump_case(case))
    before = files(folder)
    with pytest.raises(UserError, match=words) as refusal:
        folder.claim(case, force=False, resumable=True)
    assert "\n" not in str(refusal.value)
    assert files(folder) == before
    folder.claim(case, force=True, resumable=True)
    assert {"case.yaml", "jumps"} <= set(files(folder))
    assert not folder.checkpoint.exists()


def test_finished_run_of_the_same_case_may_be_repeated(case, folder):
    folder.claim(case, force=False, resumable=True)
    folder.checkpoint.touch()
    folder.summary.touch()
    folder.claim(case, force=False, resumable=True)
    assert not folder.summary.exists()


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_out_that_is_no_folder_is_one_line(start, tmp_path, place):
    (tmp_path / "file").write_text("mine")
    run = start(tmp_path / place)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert line.startswith(f"fretscale: {tmp_path}/file")
    assert (tmp_path / "file").read_text() == "mine"


def test_refusal_reaches_the_command_line(start, tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    run = start(tmp_path)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert "--force" in line


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
