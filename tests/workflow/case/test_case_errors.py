"""A wrong case ends with exit code 2 and one line: file, line, key, error and allowed values."""

import os
import re

import pytest
from click.testing import CliRunner

from tests.marks import slow
from tests.workflow.scenes import BALL
from workflow.case.fields import LONGEST_SHOWN
from workflow.cli import cli

posix_only = pytest.mark.skipif(os.name != "posix", reason="pipes and devices of POSIX")

# Name, text to replace in the default case, its replacement, key in the message, words in it.
WRONG = [
    ("unknown unit", "8 mm ", "8 mmm ", "structure.flank_length", "unknown unit 'mmm'"),
    ("case of a unit", "blade: {young: 115 GPa", "blade: {young: 115 gpa", "materials.blade.young",
     "did you mean 'GPa'"),
    ("frequency as a speed", "6000 rpm", "100 Hz", "load_path.rotation_speed", "rad/s"),
    ("angle as a ratio", "drift: 2 %", "drift: 2 deg", "coupling.drift", "a ratio"),
    ("decimal comma", "8 mm ", "8,5 mm ", "structure.flank_length", "write a point"),
    ("flank beyond 90 degrees", "45 deg", "95 deg", "structure.flank_angle", "10 deg to 80 deg"),
    ("bare angle", "45 deg", "45", "structure.flank_angle", "a bare number is in rad"),
    ("bare modulus in Pa", "blade: {young: 115 GPa", "blade: {young: 115e9",
     "materials.blade.young", "2000 GPa"),
    ("half an increment", "[8, 14]", "[8, 14.5]", "load_path.increments.1", "whole"),
    ("increments of a cycle", "[8, 14]", "22", "load_path.increments", "such as [8, 14], or auto"),
    ("an earlier spelling", "  increments: [8, 14]", "  increments: [8, 14]\n  peak_at: 8",
     "load_path.peak_at", "the first leg of increments"),
    ("grid of one cell", "[128, 256]", "[1, 256]", "contact.grid.0", "from 8 to 4096"),
    ("grid of three numbers", "[128, 256]", "[128, 256, 64]", "contact.grid", "a list of 2"),
    ("rounding past its arc", "30 mm ", "0.9 mm ", "structure.edge_width", "edge_radius, 0.9 mm"),
    ("edges wider than the flat", "1.5 mm ", "4 mm ", "structure.edge_width",
     "half the flank_length"),
    ("ends longer than the slot", "end_width: 3 mm", "end_width: 30 mm", "structure.end_width",
     "half the slot_length"),
    ("half of a rounded end", "end_width: 3 mm", "# ", "structure.end_radius", "end_radius alone;"),
    ("disk too shallow", "disk_height: 60 mm", "disk_height: 9 mm", "structure.disk_height",
     "10.78 mm"),
    ("disk beyond the axis", "disk_height: 60 mm", "disk_height: 250 mm", "structure.disk_height",
     "rim_radius"),
    ("fillet too large for the slot", "slot_fillet: 3 mm", "slot_fillet: 6 mm", "structure",
     "slot_fillet 6 mm is too large"),
    ("shank too short", "shank_height: 30 mm", "shank_height: 3 mm", "structure",
     "increase shank_height"),
    ("blades too close", "blades: 24", "blades: 60", "structure.blades", "fewer blades"),
    ("airfoil in the disk", "400 mm", "200 mm", "load_path.airfoil_radius", "250 mm"),
    ("unknown key", "neck_fillet", "neck_filet", "structure.neck_filet", "'neck_fillet'"),
    ("unknown section", "output:", "pictures:", "pictures", "allowed: title"),
    ("missing entry", "  increments: [8, 14]\n", "", "load_path.increments", "missing"),
    ("missing section", "friction: {coefficient: 0.4}", "", "friction", "missing"),
    ("missing kind", "  kind: dovetail\n", "", "structure.kind", "missing; allowed: dovetail"),
    ("missing law", "  law: energy\n", "", "wear.law", "energy_amplitude"),
    ("unknown law", "law: energy", "law: wishful", "wear.law", "energy, energy_amplitude, archard"),
    ("unknown structure", "kind: dovetail", "kind: firtree", "structure.kind", "allowed: dovetail"),
    ("unknown analysis", "analysis: wear", "analysis: magic", "analysis", "wear, contact"),
    ("missing analysis", "analysis: wear\n", "", "analysis", "missing; allowed: wear, contact"),
    ("law without its amplitude", "law: energy", "law: energy_amplitude",
     "wear.reference_amplitude", "75 um"),
    ("two step sizes", "kind: implicit}", "kind: implicit, cycles: 9, depth: 1 um}",
     "wear.step.depth", "one of cycles"),
    ("no step size", "kind: implicit}", "kind: explicit}", "wear.step.kind", "one of cycles"),
    ("share of no limit", "kind: implicit}", "kind: implicit, fraction: 0.5}",
     "wear.step.fraction", "with explicit"),
    ("text for a section", "friction: {coefficient: 0.4}", "friction: 0.4", "friction", "section"),
    ("nothing for a section", "friction: {coefficient: 0.4}", "friction:", "friction", "nothing"),
    ("unknown assumed path", "- load_path", "- load_paths", "assumed.2", "no such entry"),
    ("duplicate key", "blades: 24", "blades: 24\n  blades: 9", "'blades'", "given twice"),
]  # fmt: skip

# Name, whole text of the file, line of the error, words in the message.
UNREADABLE = [
    ("empty", b"", 1, "empty"),
    ("only a comment", b"# nothing\n", 1, "empty"),
    ("a list", b"- title\n- analysis\n", 1, "a list of 2"),
    ("a text", b"title\n", 1, "'title'"),
    ("a tab", b"title: a\nstructure:\n\tkind: dovetail\n", 3, "a tab; allowed: spaces"),
    ("broken YAML", b"title: a\nfriction: {coefficient: 0.4\nwear: 3\n", 3, "not YAML"),
    ("two documents", b"title: a\n---\ntitle: b\n", 2, "not YAML"),
    ("not UTF-8", b"title: a\nanalysis: \xff\xfe\n", 2, "UTF-8"),
    ("zero byte", b"title: a\nanalysis: \x00\n", 2, "unprintable"),
    ("number as a key", b"title: a\n3: b\n", 2, "not a key"),
    ("odd tag", b"title: !!python/name:os.system a\n", 1, "TaggedScalar"),
    ("binary", b"title: !!binary aGk=\n", 1, "a bytes"),
    ("alias bomb", b"a: &a [1,1,1,1,1,1,1,1]\n" + b"".join(
        b"%c: &%c [%s]\n" % (n + 1, n + 1, b",".join([b"*%c" % n] * 8)) for n in range(97, 105)
    ), 1, "too long"),
    ("nesting", b"title: " + b"[" * 50 + b"]" * 50, 1, "nested too deeply"),
    ("deep nesting", b"title: " + b"[" * 100_000 + b"]" * 100_000, 1, "nested too deeply"),
    ("deep sections", b"".join(b"  " * n + b"a:\n" for n in range(900)), 22, "nested too deeply"),
    ("merged without end", b"a: &a\n  <<: *a\n", 1, "not YAML"),
    ("60,000 keys", b"".join(b"k%d: 1\n" % n for n in range(60_000)), 10_001, "too long"),
    ("60,000 numbers", b"title: [" + b"1, " * 60_000 + b"1]", 1, "too long"),
    ("endless number", b"title: " + b"9" * 5000, 1, "not YAML"),
    ("huge file", b"#" * 1_000_001, None, "over 1000000 bytes"),
]  # fmt: skip


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


@pytest.mark.parametrize(
    ("old", "new", "key", "words"), [row[1:] for row in WRONG], ids=[row[0] for row in WRONG]
)
def test_wrong_entry_is_told_in_one_line(tmp_path, dovetail_text, old, new, key, words):
    assert dovetail_text.count(old) >= 1
    path = tmp_path / "wrong.yaml"
    path.write_text(dovetail_text.replace(old, new, 1), encoding="utf-8")
    line = refusal(["check", str(path)])
    place = re.match(rf"fretscale: {re.escape(str(path))}:(\d+): {re.escape(key)}: ", line)
    assert place, line
    assert words in line
    # The line in the file is that of the key, or of the section in which it is missing.
    last = key.strip("'").split(".")[-1]
    text = path.read_text().splitlines()[int(place[1]) - 1]
    missing = "missing" in line or last.isdigit()
    assert last in text or missing, (line, text)


@pytest.mark.parametrize(
    ("raw", "number", "words"),
    [slow(*row) if name.startswith("60,000") else row for name, *row in UNREADABLE],
    ids=[name for name, *_ in UNREADABLE],
)
def test_unreadable_file_is_told_in_one_line(tmp_path, raw, number, words):
    path = tmp_path / "wrong.yaml"
    path.write_bytes(raw)
    line = refusal(["check", str(path)])
    place = f"{path}:{number}: " if number else f"{path}: "
    assert line.startswith(f"fretscale: {place}"), line
    assert words in line


def no_files(folder):
    """Return paths in a folder that are no files, by the message expected for them."""
    (folder / "folder.csv").mkdir()
    (folder / "loop.csv").symlink_to("loop.csv")
    os.mkfifo(folder / "pipe.csv")
    (folder / "zero.csv").symlink_to("/dev/zero")
    return {
        "none.csv": "no such file",
        "folder.csv": "a directory",
        "loop.csv": "Too many levels",
        "pipe.csv": "a pipe or a device",
        "zero.csv": "a pipe or a device",
        f"{'x' * 300}.csv": "File name too long",
    }


@posix_only
def test_what_is_no_file_is_no_case_and_no_table(tmp_path):
    """A pipe in place of a file is refused instead of waited for."""
    for name, words in no_files(tmp_path).items():
        for command in ("check", "loops"):
            line = refusal([command, str(tmp_path / name)])
            assert line.startswith(f"fretscale: {tmp_path / name}: ")
            assert words in line


@posix_only
def test_what_is_no_file_is_told_where_it_is_named(tmp_path):
    path = tmp_path / "case.yaml"
    legs = BALL.index("  legs:"), BALL.index("contact:")
    for name, words in no_files(tmp_path).items():
        text = f"{BALL[: legs[0]]}  file: {name}\n{BALL[legs[1] :]}"
        path.write_text(text, encoding="utf-8")
        line = refusal(["check", str(path)])
        number = text[: legs[0]].count("\n") + 1
        assert line.startswith(f"fretscale: {path}:{number}: load_path.file: ")
        assert words in line


def test_of_many_mistakes_the_first_are_told(tmp_path, dovetail_text):
    path = tmp_path / "wrong.yaml"
    more = "".join(f"contakt{n}: 1\n" for n in range(500))
    path.write_text(dovetail_text + more, encoding="utf-8")
    result = CliRunner().invoke(cli, ["check", str(path)])
    *lines, last = result.stderr.splitlines()
    assert len(lines) == 20
    assert "contakt19: unknown key; did you mean 'contact'?" in lines[-1]
    assert last == f"fretscale: {path}: and 480 more errors"


def test_odd_keys_are_quoted(tmp_path, dovetail_text):
    path = tmp_path / "wrong.yaml"
    path.write_text(dovetail_text + f'"\\e[2J": 1\n{"x" * 900}: 1\n(a): 1\n', encoding="utf-8")
    result = CliRunner().invoke(cli, ["check", str(path)])
    keys = [line.split(": ")[2] for line in result.stderr.splitlines()]
    assert keys == [r"'\x1b[2J'", f"'{'x' * 59}...", "'(a)'"]


def test_every_error_has_its_line(tmp_path, dovetail_text):
    path = tmp_path / "wrong.yaml"
    text = dovetail_text.replace("45 deg", "4 deg").replace("blades: 24", "blades: 1")
    path.write_text(text.replace("increments:", "steps:"), encoding="utf-8")
    result = CliRunner().invoke(cli, ["check", str(path)])
    keys = [line.split(": ")[2] for line in result.stderr.splitlines()]
    ours = ["structure.flank_angle", "structure.blades"]
    assert keys == [*ours, "load_path.increments", "load_path.steps"]


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("friction.coefficient", "not key=value"),
        ("friction.coeficient=0.3", "did you mean 'coefficient'?"),
        ("friction.coefficient.static=0.3", "no such entry"),
        ("contact.grid.7=64", "no such entry"),
        ("structure.edge_width=[1", "not YAML"),
        ("wear.stop.depht=1 um", "did you mean 'depth'?"),
        ("contcat.grid=[32, 32]", "did you mean 'contact'?"),
        ("stress.lief.parameter=ruiz", "did you mean 'life'?"),
        ("wear.step.0.kind=explicit", "unknown key"),
        ("x" * 100_000 + "=1", "unknown key"),
        ("a." * 1000 + "a=1", "nested too deeply"),
        ("contact.grid=[]", "a list of 0: too short"),  # one line, though two items are missing
        ("contact.grid." + "9" * 5000 + "=1", "no such entry"),
    ],
)
def test_wrong_override_is_named(dovetail_path, override, words):
    line = refusal(["check", str(dovetail_path), "--set", override])
    shown = override.replace("\t", "\\t").replace("\x1b", "\\x1b")
    shown = shown if len(shown) < LONGEST_SHOWN else shown[: LONGEST_SHOWN - 1] + "..."
    assert line.startswith(f"fretscale: --set {shown}: "), line
    assert words in line
