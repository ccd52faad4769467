"""What can end a command early, and the exit code each ending has.

Imports nothing heavy, so that the command line answers at once. Each message is written for the
person who started the command: one line, what is wrong and what to do about it.
"""

from __future__ import annotations

import errno

from sa_solver.errors import FretscaleError, InputError

DONE = 0
INTERRUPTED = 130
# What the system says where no more can be written, whatever the case: a disk or a quota is full, a
# file too large, a device broken, or whoever read the output has gone.
UNWRITTEN = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EPIPE}


class Ending(FretscaleError):
    """An ending the user should read as one line, without a traceback."""

    exit_code = 3


class ExpectationMissed(Ending):
    """A computed quantity is outside the tolerance its case states."""

    exit_code = 1


class UserError(Ending):
    """A bad case, argument or file: nothing was computed."""

    exit_code = 2


class CaseError(UserError, ValueError):
    """A case file that cannot be run; one line ``file:line: key: ...`` for each thing wrong."""


class EntryError(UserError):
    """An entry of a case that the others do not suit: its ``key``, and the ``message`` about it."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(key, message)
        self.key, self.message = key, message

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


class MethodFailed(Ending):
    """A numerical method did not converge; the message carries its residual and a remedy."""

    exit_code = 3


class NotWritten(Ending):
    """What was to be written could not be; what was written before is whole, and kept."""

    exit_code = 3


class OutOfMemory(Ending):
    """The case needs more memory than there is."""

    exit_code = 4


def exit_code(error: FretscaleError) -> int:
    """The exit code of an error; one of the library's own says bad data or a failed method."""
    if isinstance(error, Ending):
        return error.exit_code
    return UserError.exit_code if isinstance(error, InputError) else MethodFailed.exit_code


def one_line(said: object) -> str:
    """What an error or a process said, its line breaks and runs of spaces as single spaces."""
    return " ".join(str(said).split())
