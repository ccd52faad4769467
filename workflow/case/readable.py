"""Numbers in base units as people read them: 0.00283 mm is 2.83 µm.

With no more digits than an estimated error leaves.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from workflow.case.units import to_base

# The units that a base unit may be shown or said in, each from so many of it on; the first from
# nothing on.
SHOWN: dict[str, tuple[tuple[str, float], ...]] = {
    "mm": (("nm", 0.0), ("um", 0.1), ("mm", 0.1), ("m", 10.0)),
    "mm^2": (("um^2", 0.0), ("mm^2", 1e-3)),
    "mm^3": (("um^3", 0.0), ("mm^3", 1e-3)),
    "N": (("mN", 0.0), ("N", 0.1), ("kN", 1.0), ("MN", 1.0)),
    "N/mm": (("N/mm", 0.0), ("kN/mm", 10.0)),
    "N*mm": (("uJ", 0.0), ("mJ", 0.1), ("J", 1.0), ("kJ", 1.0), ("MJ", 1.0)),
    "N*mm/mm": (("uJ/mm", 0.0), ("mJ/mm", 0.1), ("J/mm", 1.0), ("kJ/mm", 1.0)),
    "MPa": (("Pa", 0.0), ("kPa", 1.0), ("MPa", 0.1), ("GPa", 10.0)),
    "t": (("g", 0.0), ("kg", 0.1)),
    "t/mm^3": (("kg/m^3", 0.0),),
    "s": (("us", 0.0), ("ms", 0.1), ("s", 0.1), ("h", 2.0)),
    "Hz": (("Hz", 0.0), ("kHz", 10.0)),
    "rad": (("deg", 0.0),),
    "rad/s": (("rpm", 0.0),),
    "1/MPa": (("um^3/J", 0.0), ("mm^3/J", 1.0)),
    "1/(N*mm)": (("1/kJ", 0.0), ("1/J", 1.0)),
}
# What is read in a unit of its own though its base unit says otherwise, by a part of its name.
EVERYDAY = {
    "N*mm": (("moment", "N*m"), ("Mx", "N*mm"), ("My", "N*mm"), ("Mz", "N*mm")),
    "N/mm": (("stiffness", "N/um"), ("springs", "N/um")),
}
# Digits where nothing is known of the error, at least and at most; counts up to so many have all.
DIGITS, LEAST_DIGITS, MOST_DIGITS = 4, 2, 6
LARGEST_COUNT = 1e10
POWERS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Readable(NamedTuple):
    """A number as text, and the unit it is in, "" for none."""

    number: str
    unit: str

    def __str__(self) -> str:
        return f"{self.number} {self.unit}".strip()


def readable(value: float, unit: str, error: float | None = None, everyday: str = "") -> Readable:
    """A ``value`` in the base ``unit`` in the unit that suits it, or in an ``everyday`` one.

    With digits down to its relative ``error``. What is not finite is told in words.
    """
    if not math.isfinite(value):
        return Readable("not a number" if math.isnan(value) else "infinite", "")
    shown, factor = suited(value, unit, everyday)
    return Readable(_text(value / factor, error, whole=not shown), shown)


def everyday_unit(unit: str | None, name: str) -> str:
    """The unit in which a quantity of that name is always told, "" where there is none."""
    return next((shown for part, shown in EVERYDAY.get(unit or "", ()) if part in name), "")


def suited(value: float, unit: str, everyday: str = "") -> tuple[str, float]:
    """The unit in print that suits a value in a base ``unit``, and how large it is."""
    base = unit.replace(" ", "*")
    shown = everyday or suited_unit(value, unit)
    return pretty(shown), to_base(f"1 {shown}", base) if shown != base else 1.0


def pretty(unit: str) -> str:
    """A unit in print: µm² for um^2."""
    if unit in ("", "1"):
        return ""
    unit = unit.replace("^2", "²").replace("^3", "³").replace("*", "·").replace(" ", "·")
    for small in ("um", "us", "uJ"):
        unit = unit.replace(small, f"µ{small[1:]}")
    return unit


def percent(share: float) -> str:
    """A share in per cent, with two digits."""
    if share == 0.0:
        return "0 %"
    if abs(share) < 1e-4:
        return "< 0.01 %"
    digits = max(0, 1 - math.floor(math.log10(abs(100.0 * share))))
    return f"{100.0 * share:.{min(digits, 2)}f} %"


def suited_unit(value: float, unit: str) -> str:
    """The largest of the units of a base ``unit`` of which there are enough."""
    fitting = base = unit.replace(" ", "*")
    for unit, least in SHOWN.get(base, ()):
        if least == 0.0 or abs(value) >= least * to_base(f"1 {unit}", base) * (1.0 - 1e-9):
            fitting = unit
    if value == 0.0 and base in SHOWN:  # of nothing there is as much in every unit
        ladder = [unit for unit, _ in SHOWN[base]]
        return base if base in ladder else ladder[len(ladder) // 2]
    return fitting


def _text(value: float, error: float | None, whole: bool) -> str:
    """Down to the first digit of the error; plain ``whole`` numbers are counts, with all digits."""
    if value == 0.0:
        return "0"
    digits = DIGITS
    if whole and value == round(value) and abs(value) < LARGEST_COUNT and not error:
        return f"{value:.0f}"
    if error:
        # 2.83 ± 0.04 has three digits, 9.9 ± 0.1 two.
        last = math.floor(math.log10(abs(value) * error))
        known = math.floor(math.log10(abs(value))) - last + 1
        digits = min(MOST_DIGITS, max(LEAST_DIGITS, known))
    elif error is not None:
        digits = MOST_DIGITS
    text, power = _plain(value, digits)
    if (not error or digits == MOST_DIGITS) and "." in text:  # these noughts tell nothing
        text = text.rstrip("0").rstrip(".")
    return text + power


def _plain(value: float, digits: int) -> tuple[str, str]:
    """So many digits, and the power of ten beside them where it takes one to read them."""
    rounded = float(f"{value:.{digits}g}")
    exponent = math.floor(math.log10(abs(rounded)))
    if -4 <= exponent < 7:
        return f"{rounded:.{max(0, digits - 1 - exponent)}f}", ""
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    return mantissa, f"·10{str(int(power)).translate(POWERS)}"
