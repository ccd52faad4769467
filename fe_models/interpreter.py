"""Command line of a fresh Python interpreter that finds the same modules as this one."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = str(Path(__file__).parents[1])


def fresh_python(code: str) -> list[str]:
    """Return the command that runs ``code`` in a separate Python process.

    The process searches modules where this one does, but not in its working directory: a file there
    may have the name of one of our packages. It does not know the ``__main__`` of this process,
    which may be a notebook, a script without a guard, or standard input.
    """
    places = [place for place in sys.path if isinstance(place, str) and place] + [ROOT]
    return [sys.executable, "-c", f"import sys; sys.path[:] = {places!r}; {code}"]
