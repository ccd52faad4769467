"""Tests of terminal output of a run: amount, progress, and final hints."""

from __future__ import annotations

import io
import re
from collections.abc import Callable

import pytest
from click.testing import CliRunner
from rich.console import Console

from tests.marks import slow
from workflow.cli import TO_TRY, cli
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.terminal import screen
from workflow.shell.terminal.reporter import LINE, Reporter
from workflow.shell.terminal.screen import Loudness

TOLD = f"warning: too coarse [{WarningKind.FEW_CELLS.code}]"


def said_by(reporter: Reporter) -> None:
    reporter.say("a line")
    reporter.log("a detail")
    with reporter.stage("mesh"):
        reporter.warn(WarningKind.FEW_CELLS, "too coarse")
    reporter.close()


def without_times(lines: list[str]) -> list[str]:
    return [re.sub(r"[\d.]+ s$", "... s", line) for line in lines]


@pytest.mark.parametrize(
    ("loudness", "received"),
    [
        (Loudness.QUIET, [TOLD]),
        (Loudness.NORMAL, ["a line", TOLD]),
        (Loudness.VERBOSE, ["a line", "a detail", TOLD, "mesh: ... s"]),
    ],
)
def test_the_log_has_all_however_quiet_it_is(loudness, received, tmp_path, capsys):
    said_by(Reporter(tmp_path / "log", loudness=loudness))
    assert without_times(capsys.readouterr().err.splitlines()) == received
    logged = [line[9:] for line in (tmp_path / "log").read_text("utf-8").splitlines()]
    assert without_times(logged) == ["a line", "a detail", TOLD, "mesh: ... s"]


@pytest.fixture
def terminal(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Callable[[], str]:
    """Replace stderr by a terminal of 80 or other columns; return a function with its content.

    It moves its cursor, whatever terminal the tests are run on.
    """
    shown = io.StringIO()
    console = Console(
        file=shown,
        force_terminal=True,
        width=getattr(request, "param", 80),
        highlight=False,
        _environ={"TERM": "xterm"},
    )
    monkeypatch.setattr(screen, "console", lambda: console)
    monkeypatch.setattr(screen, "BRIEF", -1.0)
    return shown.getvalue


def test_a_stage_shows_how_far_it_is(terminal, tmp_path, monkeypatch):
    monkeypatch.setattr("workflow.shell.terminal.reporter.LOOK", -1.0)
    reporter = Reporter(tmp_path / "log")
    with reporter.stage("condensation", "bodies") as reported:
        reported(1, 2)
        reporter._screen._rows.refresh()
    reporter.close()
    (row,) = {line for line in terminal().splitlines() if "1 of 2 bodies" in line}
    assert "condensation" in row
    assert "more" in row


def test_where_there_is_no_terminal_a_line_now_and_then(tmp_path, monkeypatch, capsys):
    """1000 nodes in ten minutes give ten lines."""
    now = [100.0]
    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    reporter = Reporter(tmp_path / "log")
    with reporter.stage("condensation", "nodes") as reported:
        for number in range(1, 1001):
            now[0] += 0.6
            reported(number, 1000)
    reporter.close()
    lines = capsys.readouterr().err.splitlines()
    assert 600.0 / LINE - 2 < len(lines) <= 600.0 / LINE
    assert "condensation: " in lines[0]
    assert "of 1000 nodes" in lines[0]


# --- the first and the last lines -----------------------------------------------------------------


def to_try() -> list[list[str]]:
    lines = [line.strip().partition("   ")[0] for line in TO_TRY.splitlines()]
    return [line.split()[1:] for line in lines if line.startswith("fretscale ")]


def test_without_arguments_commands_to_try_are_printed() -> None:
    reported = CliRunner().invoke(cli, [])
    assert (reported.exit_code, reported.stderr) == (0, "")
    assert TO_TRY in reported.stdout
    assert max(map(len, reported.stdout.splitlines())) <= 80
    assert [arguments[0] for arguments in to_try()] == ["new", "check", "run"]


@slow
def test_the_proposed_commands_work_and_leave_a_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for arguments in to_try():
        assert CliRunner().invoke(cli, arguments).exit_code == 0, arguments
    assert list(tmp_path.glob("out/ball/figures/*.png"))


def test_the_help_lists_every_command_once() -> None:
    reported = CliRunner().invoke(cli, ["--help"], terminal_width=80).stdout
    rows = [line.split()[0] for line in reported.splitlines() if line.startswith("  ")]
    assert all(rows.count(name) == 1 for name in cli.commands)
