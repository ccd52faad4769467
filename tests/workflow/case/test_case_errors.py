"""A wrong case ends with exit code 2 and one line: file, line, key, error and allowed values."""

import os
import re

import pytest
from click.testing import CliRunner
from pydantic_core import PydanticCustomError

from workflow.analyses.wear.case.base import check_interface_name
from workflow.cli import cli
from workflow.errors import CaseError
from workflow.kinds import parse_case, template

posix_only = pytest.mark.skipif(os.name != "posix", reason="pipes and devices of POSIX")

WRONG = [
    ("8 mm ", "8 mmm ", "structure.flank_length"),
    ("blade: {young: 115 GPa", "blade: {young: 115 gpa", "materials.blade.young"),
    ("6000 rpm", "100 Hz", "load_path.rotation_speed"),
    ("drift: 2 %", "drift: 2 deg", "coupling.drift"),
    ("8 mm ", "8,5 mm ", "structure.flank_length"),
    ("45 deg", "95 deg", "structure.flank_angle"),
    ("[8, 14]", "[8, 14.5]", "load_path.increments.1"),
    ("[8, 14]", "22", "load_path.increments"),
    ("[96, 192]", "[96, 192, 64]", "contact.grid"),
    ("30 mm ", "0.9 mm ", "structure.edge_width"),
    ("1.5 mm ", "4 mm ", "structure.edge_width"),
    ("end_width: 3 mm", "end_width: 30 mm", "structure.end_width"),
    ("end_width: 3 mm", "# ", "structure.end_radius"),
    ("disk_height: 60 mm", "disk_height: 9 mm", "structure.disk_height"),
    ("disk_height: 60 mm", "disk_height: 250 mm", "structure.disk_height"),
    ("slot_fillet: 3 mm", "slot_fillet: 6 mm", "structure"),
    ("shank_height: 30 mm", "shank_height: 3 mm", "structure"),
    ("blades: 24", "blades: 60", "structure.blades"),
    ("400 mm", "200 mm", "load_path.airfoil_radius"),
    ("neck_fillet", "neck_filet", "structure.neck_filet"),
    ("output:", "pictures:", "pictures"),
    ("  increments: [8, 14]\n", "", "load_path.increments"),
    ("friction: {coefficient: 0.4}", "", "friction"),
    ("law: energy", "law: wishful", "wear.law"),
    ("kind: dovetail", "kind: firtree", "structure.kind"),
    ("analysis: wear", "analysis: magic", "analysis"),
    ("law: energy", "law: energy_amplitude", "wear.reference_amplitude"),
    ("kind: implicit}", "kind: implicit, cycles: 9, depth: 1 um}", "wear.step.depth"),
    ("kind: implicit}", "kind: explicit}", "wear.step.kind"),
    ("kind: implicit}", "kind: implicit, cycles: 1}", "wear.step.cycles"),
    ("friction: {coefficient: 0.4}", "friction: 0.4", "friction"),
    ("- load_path", "- load_paths", "assumed.2"),
    ("blades: 24", "blades: 24\n  blades: 9", "'blades'"),
]

UNREADABLE = {
    "a comment": (b"# nothing\n", 1),
    "a list": (b"- title\n- analysis\n", 1),
    "a tab": (b"title: a\nstructure:\n\tkind: dovetail\n", 3),
    "broken": (b"title: a\nfriction: {coefficient: 0.4\nwear: 3\n", 3),
    "not UTF-8": (b"title: a\nanalysis: \xff\xfe\n", 2),
    "zero byte": (b"title: a\nanalysis: \x00\n", 2),
    "number as a key": (b"title: a\n3: b\n", 2),
    "odd tag": (b"title: !!python/name:os.system a\n", 1),
    "deep nesting": (b"title: " + b"[" * 100_000 + b"]" * 100_000, 1),
    "merged without end": (b"a: &a\n  <<: *a\n", 1),
    "60,000 numbers": (b"title: [" + b"1, " * 60_000 + b"1]", 1),
    "endless number": (b"title: " + b"9" * 5000, 1),
}


def refusal(arguments):
    """Return the only line on stderr of a command that must end with exit code 2."""
    result = CliRunner().invoke(cli, arguments)
    assert result.exit_code == 2, (result.stdout, result.stderr, result.exception)
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    (line,) = result.stderr.splitlines()
    assert len(line) < 600
    return line


@pytest.mark.parametrize(("old", "new", "key"), WRONG)
def test_wrong_entry_is_refused_with_its_line_and_key(tmp_path, dovetail_text, old, new, key):
    assert dovetail_text.count(old) >= 1
    path = tmp_path / "wrong.yaml"
    path.write_text(dovetail_text.replace(old, new, 1), encoding="utf-8")
    line = refusal(["check", str(path)])
    place = re.match(rf"fretscale: {re.escape(str(path))}:(\d+): {re.escape(key)}: ", line)
    assert place, line
    # The line in the file is that of the key, or of the section in which it is missing.
    last = key.strip("'").split(".")[-1]
    text = path.read_text().splitlines()[int(place[1]) - 1]
    assert last in text or "missing" in line or last.isdigit(), (line, text)


@pytest.mark.parametrize(("raw", "number"), UNREADABLE.values(), ids=UNREADABLE)
def test_unreadable_file_is_refused_with_its_line(tmp_path, raw, number):
    path = tmp_path / "wrong.yaml"
    path.write_bytes(raw)
    assert refusal(["check", str(path)]).startswith(f"fretscale: {path}:{number}: ")


def no_files(folder):
    """Make entries of a folder that are no files, and return their names."""
    (folder / "folder.csv").mkdir()
    os.mkfifo(folder / "pipe.csv")
    (folder / "zero.csv").symlink_to("/dev/zero")
    return "none.csv", "folder.csv", "pipe.csv", "zero.csv"


@posix_only
def test_folders_pipes_and_devices_are_refused_as_cases_and_tables(tmp_path):
    """A pipe in place of a file is refused instead of waited for."""
    for name in no_files(tmp_path):
        for command in ("check", "loops"):
            line = refusal([command, str(tmp_path / name)])
            assert line.startswith(f"fretscale: {tmp_path / name}: ")


@pytest.mark.parametrize(
    "override",
    [
        "friction.coefficient",
        "friction.coeficient=0.3",
        "friction.coefficient.static=0.3",
        "contact.grid.7=64",
        "contact.grid=[]",  # one line, though two items are missing
        "structure.edge_width=[1",
        "contcat.grid=[32, 32]",
    ],
)
def test_wrong_override_is_named(dovetail_path, override):
    line = refusal(["check", str(dovetail_path), "--set", override])
    assert line.startswith(f"fretscale: --set {override}: ")


def test_a_motion_without_end_is_refused():
    with pytest.raises(CaseError, match=r"step=1e-12: .* time steps; allowed: at most"):
        parse_case(template("rig"), "case.yaml", ["integration.step=1e-12"])


@pytest.mark.parametrize("name", ["", " ", "a/b", ".", "..", "surfaces"])
def test_a_contact_has_a_name_that_results_can_have(name):
    with pytest.raises(PydanticCustomError, match="an interface called"):
        check_interface_name(name, "contacts.0.name")
