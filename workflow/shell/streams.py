"""The standard streams of a process, of which a program may be started without some.

And what they show of letters that their encoding does not have.
"""

from __future__ import annotations

import codecs
import os
import re
import sys
from typing import TextIO

# How letters beyond ASCII are spelled where there are none.
SPELLED = {
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
    """Let no file get the number of a stream that is closed, here or in processes of ours."""
    while (free := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(free, True)
    os.close(free)


def spell_what_streams_lack() -> None:
    """Let output and messages spell what their encoding does not have: um for µm, m^2 for m²."""
    codecs.register_error(HANDLER, _spelled)
    for stream in (sys.stdout, sys.stderr):
        _reconfigure(stream)


def _reconfigure(stream: TextIO | None) -> None:
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors=HANDLER)


def _spelled(error: UnicodeError) -> tuple[str, int]:
    """What stands for the letters that cannot be encoded, and where to go on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing = error.object[error.start : error.end]
    text = POWER.sub(lambda found: f"^{found[0].translate(POWERS)}", missing)
    return "".join(SPELLED.get(letter, _ascii(letter)) for letter in text), error.end


def _ascii(letter: str) -> str:
    """A letter that no spelling is known of, by its number."""
    return letter if letter.isascii() else letter.encode("ascii", "backslashreplace").decode()
