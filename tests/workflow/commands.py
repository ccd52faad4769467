"""The command line in the process of the test."""

from collections.abc import Sequence

from click.testing import CliRunner, Result

from workflow.cli import cli


def invoke(*arguments: object) -> Result:
    """``fretscale`` with these arguments; anything but an exit is raised."""
    result = CliRunner().invoke(cli, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def command(name: str, *arguments: object, overrides: Sequence[str] = ()) -> Result:
    """``fretscale name`` with overrides (``"wear.cycles=1e4"``)."""
    return invoke(name, *arguments, *(part for entry in overrides for part in ("--set", entry)))
