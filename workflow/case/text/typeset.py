"""Typography of sentences and numbers in reports: −3.5 µm, 12 mm³, 1,080,000."""

from __future__ import annotations

import re

MINUS = "\N{MINUS SIGN}"
# A hyphen before a number: after nothing, a space, a bracket or the like, not within a word.
NEGATIVE = re.compile(r"(?<![\w.)\]-])-(?=\.?\d)")
# A number with an exponent: 1.3e+06.
EXPONENT = re.compile(r"(?<![\w.])(\d(?:\.\d+)?)e([+-]?)0*(\d+)\b")
# Units as they are typed in plain text.
MICRO = re.compile(r"(?<![A-Za-z])u(?=(?:m|s|J)\b|m[\^²³])")
POWER = re.compile(r"(?<=[mMs])\^([23])(?!\d)")
PER_CENT = re.compile(r"(?<=\d)\s?%")
QUANTITY = r"-?\d+(?:\.\d+)?(?:·10\S+)?(?: [^\s,]+)?"
# Numbers of five or more digits before the point are easier to read in groups of three.
LONG = re.compile(r"(?<![\w.,])\d{5,}(?=\D|$)")
QUANTITIES = re.compile(rf"{QUANTITY}(?:, {QUANTITY})*")
POWERS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
SUPERSCRIPT = {"2": "²", "3": "³"}


def typeset(text: str) -> str:
    """Return plain text with the typographic signs of a printed text."""
    text = EXPONENT.sub(_power_of_ten, text)
    text = POWER.sub(lambda found: SUPERSCRIPT[found[1]], MICRO.sub("µ", minus(text)))
    return PER_CENT.sub("\N{NO-BREAK SPACE}%", text.replace(" -> ", " → "))


def minus(text: str) -> str:
    """Return a text with minus signs in place of hyphens before numbers."""
    return NEGATIVE.sub(MINUS, text)


def number(text: str) -> str:
    """Return a number, with its unit or without, as it is printed."""
    return LONG.sub(_grouped, typeset(text))


def unparted(text: str) -> str:
    """Return a text with no line breaks between numbers and their units."""
    return re.sub(r"(?<=\d) (?=[^\W\d])", "\N{NO-BREAK SPACE}", text)


def given(text: str) -> str:
    """Return an entry of a case, typeset as numbers if it consists of them."""
    return number(text) if QUANTITIES.fullmatch(text) else text


def _power_of_ten(found: re.Match[str]) -> str:
    size, sign, power = found.groups()
    exponent = f"10{(sign.strip('+') + power).translate(POWERS)}"
    return exponent if size == "1" else f"{size}·{exponent}"


def _grouped(found: re.Match[str]) -> str:
    return f"{int(found[0]):,}"
