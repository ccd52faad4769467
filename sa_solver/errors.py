"""What the library raises: one base, and the two kinds that a caller can act on.

Every exception of ``sa_solver``, ``wear`` and ``fe_models`` is a :class:`FretscaleError`. Each is a
ValueError or a RuntimeError besides, so that code which knows nothing of them still reads them
right. Messages are one sentence: what is wrong, and what to give or try instead.
"""

from __future__ import annotations


class FretscaleError(Exception):
    """Base of everything that fretscale raises on purpose."""


class InputError(FretscaleError, ValueError):
    """Data that have no meaning, or that admit no solution: other data are needed."""


class ConvergenceError(FretscaleError, RuntimeError):
    """A numerical method that did not come to its end: the data may well have a solution."""


class ContactProblemError(InputError):
    """A contact problem without a solution: loads that no contact carries, or impossible fields."""
