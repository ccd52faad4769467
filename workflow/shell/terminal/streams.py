"""Standard streams of a process, some of which may be closed or lack letters in their encoding."""

from __future__ import annotations

import codecs
import os
import re
import sys
from typing import TextIO

# Replacements for non-ASCII letters that an encoding lacks.
REPLACEMENTS = {
    "µ": "u",
    "μ": "u",
    "±": "+-",
    "−": "-",
    "–": "-",
    "×": "x",
    "·": "*",
    "→": "->",
    "≈": "about ",
    "≤": "<=",
    "≥": ">=",
    "°": "deg",
    "…": "...",
    "\u00a0": " ",
    "\u2060": "",
    "“": '"',
    "”": '"',
    "‘": "'",
    "’": "'",
    "α": "alpha",
    "ξ": "xi",
    "π": "pi",
}
POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
POWER = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
HANDLER = "fretscale.spelled"


def hold_standard_streams() -> None:
    """Keep other files from getting the numbers of closed standard streams, here or in children."""
    while (free := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(free, True)
    os.close(free)


def replace_missing_characters() -> None:
    """Make stdout and stderr replace letters that their encoding lacks: um for µm, m^2 for m²."""
    codecs.register_error(HANDLER, _replacement)
    for stream in (sys.stdout, sys.stderr):
        _reconfigure(stream)


def _reconfigure(stream: TextIO | None) -> None:
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors=HANDLER)


def _replacement(error: UnicodeError) -> tuple[str, int]:
    """Return the replacement of letters that cannot be encoded, and the position to continue at."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    text = POWER.sub(lambda found: f"^{found[0].translate(POWERS)}", missing)
    return "".join(REPLACEMENTS.get(letter, _ascii(letter)) for letter in text), error.end


def _ascii(letter: str) -> str:
    """Return a letter that has no replacement as its escaped code."""
    return letter if letter.isascii() else letter.encode("ascii", "backslashreplace").decode()
