"""Exceptions that end a command early, each with its exit code.

This module imports nothing heavy, so that the command line answers at once. Each message is for the
user of the command: one line that says what is wrong and what to do about it.
"""

from __future__ import annotations

import errno
import warnings
from collections.abc import Iterable

from sa_solver.errors import FretscaleError, InputError
from workflow.messages.error_kinds import error_kind
from workflow.messages.warning_kinds import Notice, WarningKind

DONE = 0
INTERRUPTED = 130
# Errors of the system that mean that no more can be written, whatever the case: a disk or quota is
# full, a file too large, a device broken, or the reader of the output has gone.
UNWRITTEN = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EPIPE}


class Ending(FretscaleError):
    """Error that is shown to the user as one line, without a traceback."""

    exit_code = 3


class ExpectationMissed(Ending):
    """Computed quantity outside the tolerance that its case states."""

    exit_code = 1


class UserError(Ending):
    """Invalid case, argument or file; nothing was computed."""

    exit_code = 2


class CaseError(UserError, ValueError):
    """Case file that cannot be run; one line ``file:line: key: ...`` for each error."""


class EntryError(UserError):
    """Entry of a case that contradicts others: its ``key``, and the ``message`` about it."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(key, message)
        self.key, self.message = key, message

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


class FolderInUse(UserError):
    """Folder in which another process computes."""


class FolderTaken(UserError):
    """Folder or file that exists, and would be overwritten."""


class RunChanged(UserError):
    """Stored run whose files are missing, changed, damaged or of another version."""


class TooCoarse(UserError, InputError):
    """Contact on a single point of its grid or mesh."""


class MethodFailed(Ending):
    """Numerical method that did not converge; the message has its residual and a remedy."""

    exit_code = 3


class RunsFailed(MethodFailed):
    """Command of several runs, some of which failed."""


class ProcessLost(MethodFailed):
    """Process of a run that ended unexpectedly."""


class ClusterLost(MethodFailed):
    """Scheduler or workers of a cluster that are gone."""


class NotWritten(Ending):
    """Output that could not be written; earlier output is complete and remains."""

    exit_code = 3


class OutOfMemory(Ending):
    """Case that needs more memory than there is."""

    exit_code = 4


def exit_code(error: FretscaleError) -> int:
    """Return the exit code of an error.

    Among the errors of the numerical library, an ``InputError`` means invalid data, any other one a
    failed method.
    """
    if isinstance(error, Ending):
        return error.exit_code
    return UserError.exit_code if isinstance(error, InputError) else MethodFailed.exit_code


def one_line(printed: object) -> str:
    """Return a text in one line, with single spaces for line breaks and runs of spaces."""
    return " ".join(str(printed).split())


def marked_line(error: FretscaleError) -> str:
    """Return the message of an error in one line, with its code at the end."""
    return error_kind(error).marked(one_line(error))


class ModelWarning(UserWarning):
    """Warning about a model whose results are computed, but may be wrong.

    ``code`` is its code, such as ``FS-W102``, which ``fretscale explain`` explains.
    """

    def __init__(self, kind: WarningKind, text: str) -> None:
        super().__init__(kind, text)
        self.kind, self.text = kind, text

    def __str__(self) -> str:
        return self.kind.marked(self.text)

    @property
    def code(self) -> str:
        """Code of the warning."""
        return self.kind.code


def warn_each(notices: Iterable[Notice]) -> None:
    """Give a :class:`ModelWarning` for each of ``notices``, at the place that runs the model."""
    for notice in notices:
        warnings.warn(ModelWarning(*notice), stacklevel=3)
