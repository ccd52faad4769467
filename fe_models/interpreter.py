"""A fresh Python beside this one, which finds our modules wherever this one has found them."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = str(Path(__file__).parents[1])


def fresh_python(code: str) -> list[str]:
    """The command that runs ``code``, which imports modules of ours, in a process of its own.

    That process looks for modules where this one does, but not in the folder where it is started:
    there somebody may have a file with the name of one of our packages. It does not know the
    ``__main__`` of this one, which may be a notebook, a script without a guard, or standard input.
    """
    places = [place for place in sys.path if isinstance(place, str) and place] + [ROOT]
    return [sys.executable, "-c", f"import sys; sys.path[:] = {places!r}; {code}"]
