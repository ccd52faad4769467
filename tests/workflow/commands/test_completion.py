"""Tests of the shell completion of a command."""

import os
import subprocess
import sys

from click.shell_completion import BashComplete

from workflow.cli import cli

VARIABLE = "_FRETSCALE_COMPLETE"


def completed(*words):
    """Return value and type of the possible completions of the last word."""
    shell = BashComplete(cli, {}, "fretscale", VARIABLE)
    return [(c.value, c.type) for c in shell.get_completions(list(words[:-1]), words[-1])]


def test_commands_are_completed():
    assert completed("ch") == [("chart", "plain"), ("check", "plain")]
    assert ("run", "plain") in completed("")


def test_files_are_completed():
    """The shell completes files itself: it receives the type of the word."""
    assert completed("run", "ca") == [("ca", "file")]
    assert completed("resume", "ou") == [("ou", "dir")]


def test_a_shell_gets_its_script():
    """``eval "$(_FRETSCALE_COMPLETE=zsh_source fretscale)"`` gives no message about a pipe."""
    ended = subprocess.run(
        [sys.executable, "-c", "from workflow.cli import main; main()"],
        env={**os.environ, VARIABLE: "zsh_source"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.startswith("#compdef fretscale")
