"""Names of contact faces, which become names of groups in the results."""

from __future__ import annotations

from sa_solver import checks
from sa_solver.errors import InputError

# Names that the results of a model have in addition to those of its faces.
TAKEN = ("bodies", "cycles", "drift", "per_length")


def is_group_name(name: object) -> bool:
    """Return whether a group of results can have this name: a text without /, not a path."""
    return isinstance(name, str) and "/" not in name and name.strip() not in ("", ".", "..")


def check_face_name(name: object) -> None:
    """Raise InputError for a name that no contact face can have."""
    if not is_group_name(name) or name in TAKEN:
        raise InputError(
            f"a contact face is called {checks.shown(name)}: give a name without /, other than "
            f"{', '.join(TAKEN)}"
        )
