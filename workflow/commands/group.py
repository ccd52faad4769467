"""Group of all commands: its help, and how each command ends.

Any error ends a command with one line and an exit code (``workflow.errors``). This module imports
nothing heavy, so that the command line answers at once.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NoReturn

import click

from sa_solver.errors import FretscaleError
from workflow import errors
from workflow.messages.error_kinds import ErrorKind, error_kind

# How to continue a command that was stopped.
ADVICE = "continue a run with `fretscale resume DIR`, several with the same command"
# Commands in the order and groups of the help.
LISTED = {
    "A case": ("new", "check", "run", "resume"),
    "Results": ("report", "compare", "explain"),
    "Many runs": ("sweep", "chart", "verify"),
    "Input and output": ("materials", "describe", "resultants", "surface", "schema"),
    "Measurements": ("loops", "scar", "fit"),
}


class OneLineGroup(click.Group):
    """Group of commands whose failures become one line on stderr and an exit code."""

    def main(self, *args: Any, **settings: Any) -> NoReturn:
        settings["standalone_mode"] = False
        message, kind = "", ErrorKind.REFUSED
        try:
            code = super().main(*args, **settings)
            if sys.stdout is not None:
                sys.stdout.flush()
        except (FretscaleError, OSError, ImportError, MemoryError) as error:
            message, kind, code = _ending(error)
        except SystemExit as ended:
            if not ended.code:  # click has printed the shell completion of a command
                raise
            # click and rich end this way when a pipe was closed.
            message, kind, code = _ending(BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE)))
        except click.Abort as abort:
            if isinstance(abort.__cause__, EOFError):
                raise abort.__cause__ from None  # no command asks for input: a file is damaged
            left = f": {stop}" if (stop := abort.__cause__) and stop.args else ""
            message, kind, code = f"interrupted{left}", ErrorKind.INTERRUPTED, errors.INTERRUPTED
        except click.ClickException as error:
            message, code = _usage(error), errors.UserError.exit_code
        if message:
            message = kind.marked(message)
        _say([f"fretscale: {line}" for line in message.splitlines()])
        sys.exit(code if isinstance(code, int) else errors.DONE)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        longest = max(map(len, self.commands))
        for title, names in LISTED.items():
            rows = [
                (name.ljust(longest), self.commands[name].get_short_help_str(formatter.width))
                for name in names
            ]
            with formatter.section(title):
                formatter.write_dl(rows)


def _say(lines: Sequence[str]) -> None:
    """Print why a command ended, if stderr can be written, and flush all output."""
    with suppress(OSError):
        for line in lines:
            click.echo(line, err=True)
    for stream in (sys.stdout, sys.stderr):
        if stream is None:
            continue
        try:
            stream.flush()
        except OSError:
            # Python would flush again at exit and report that it cannot.
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _ending(error: Exception) -> tuple[str, ErrorKind, int]:
    """Return the message about ``error``, one line per problem, its kind, and the exit code."""
    if isinstance(error, MemoryError):
        message = f"out of memory: {error}".rstrip(": ")
        return message, ErrorKind.OUT_OF_MEMORY, errors.OutOfMemory.exit_code
    if isinstance(error, FretscaleError):
        return str(error), error_kind(error), errors.exit_code(error)
    if isinstance(error, BrokenPipeError) and error.filename is None:
        # As for `head`: the reader needs no more.
        return "", ErrorKind.OUTPUT_FAILED, errors.NotWritten.exit_code
    if isinstance(error, OSError) and error.errno in errors.UNWRITTEN:
        written = f"output: {error.strerror}"
        if error.filename is not None:
            written = f"{error.filename}: {error.strerror}; {ADVICE}"
        return written, ErrorKind.OUTPUT_FAILED, errors.NotWritten.exit_code
    from workflow.shell.system_check import remedy

    if missing := remedy(error):
        return missing, ErrorKind.PACKAGE_MISSING, errors.MethodFailed.exit_code
    if isinstance(error, OSError) and error.filename is not None:
        message = f"{error.filename}: {error.strerror}"
        return message, ErrorKind.FILE_UNUSABLE, errors.UserError.exit_code
    raise error


def _usage(error: click.ClickException) -> str:
    """Return a usage error in one line."""
    context = getattr(error, "ctx", None)
    hint = f"; see `{context.command_path} --help`" if context else ""
    return " ".join(error.format_message().split()).rstrip(".") + hint
