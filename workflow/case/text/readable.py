"""Numbers in base units as readable text: 0.00283 mm is 2.83 µm.

The second digit of the estimated error is the last one shown: 2.830 ± 0.021 µm.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from workflow.case.units import to_base

# Units in which a base unit is shown, each with the smallest number of it that is shown so. The
# first is for all smaller values.
SHOWN: dict[str, tuple[tuple[str, float], ...]] = {
    "mm": (("nm", 0.0), ("um", 0.1), ("mm", 0.1), ("m", 10.0)),
    "mm^2": (("um^2", 0.0), ("mm^2", 1e-3)),
    "mm^3": (("um^3", 0.0), ("mm^3", 1e-3)),
    "mm^3/mm": (("um^3/mm", 0.0), ("mm^3/mm", 1e-3)),
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
# Quantities with a fixed display unit, found by a part of their name.
EVERYDAY = {
    "N*mm": (("moment", "N*m"), ("Mx", "N*mm"), ("My", "N*mm"), ("Mz", "N*mm")),
    "N/mm": (("stiffness", "N/um"), ("springs", "N/um")),
}
# Digits if the error is unknown, and the least and most digits; counts below LARGEST_COUNT are
# shown in full, and given numbers with ALL_DIGITS.
DIGITS, LEAST_DIGITS, MOST_DIGITS, ALL_DIGITS = 4, 2, 6, 12
LARGEST_COUNT = 1e10
POWERS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Readable(NamedTuple):
    """Number as text, and its unit, "" for none."""

    number: str
    unit: str

    def __str__(self) -> str:
        return f"{self.number} {self.unit}".strip()


def readable(
    value: float,
    unit: str,
    error: float | None = None,
    everyday: str = "",
    most: int = MOST_DIGITS,
) -> Readable:
    """Return ``value``, in the base ``unit``, as text in a suitable unit, or in ``everyday``.

    The relative ``error`` limits the digits, of which there are at most ``most``. Values that are
    not finite become words.
    """
    if not math.isfinite(value):
        return Readable("not a number" if math.isnan(value) else "infinite", "")
    shown, factor = suited(value, unit, everyday)
    return Readable(_text(value / factor, error, not shown, most), shown)


def everyday_unit(unit: str | None, name: str) -> str:
    """Return the fixed unit for quantities of this name, "" if there is none."""
    return next((shown for part, shown in EVERYDAY.get(unit or "", ()) if part in name), "")


def suited(value: float, unit: str, everyday: str = "") -> tuple[str, float]:
    """Return the printed name and the size, in the base ``unit``, of a suitable unit."""
    base = unit.replace(" ", "*")
    shown = everyday or suited_unit(value, unit)
    return pretty(shown), to_base(f"1 {shown}", base) if shown != base else 1.0


def pretty(unit: str) -> str:
    """Return a unit as it is printed: µm² for um^2."""
    if unit in ("", "1"):
        return ""
    unit = unit.replace("^2", "²").replace("^3", "³").replace("*", "·").replace(" ", "·")
    for small in ("um", "us", "uJ"):
        unit = unit.replace(small, f"µ{small[1:]}")
    return unit


def percent(share: float) -> str:
    """Return a share in per cent with two digits, as text."""
    if share == 0.0:
        return "0 %"
    if abs(share) < 1e-4:
        return "< 0.01 %"
    digits = max(0, 1 - _exponent(100.0 * share, 2))
    return f"{100.0 * share:.{min(digits, 2)}f} %"


def suited_unit(value: float, unit: str) -> str:
    """Return the largest unit for a base ``unit`` in which the value is not too small a number."""
    fitting = base = unit.replace(" ", "*")
    for unit, least in SHOWN.get(base, ()):
        if least == 0.0 or abs(value) >= least * to_base(f"1 {unit}", base) * (1.0 - 1e-9):
            fitting = unit
    if value == 0.0 and base in SHOWN:  # zero is the same in every unit
        ladder = [unit for unit, _ in SHOWN[base]]
        return base if base in ladder else ladder[len(ladder) // 2]
    return fitting


def _exponent(value: float, digits: int) -> int:
    """Return the power of ten of the first digit of a number that is rounded to ``digits``."""
    return int(f"{value:.{digits - 1}e}".partition("e")[2])


def _text(value: float, error: float | None, whole: bool, most: int) -> str:
    """Return a number down to the second digit of its error; a ``whole`` count has all digits."""
    if value == 0.0:
        return "0"
    digits = DIGITS
    if whole and value == round(value) and abs(value) < LARGEST_COUNT and not error:
        return f"{value:.0f}"
    if error:
        last = _exponent(value * error, 2) - 1
        first = _exponent(round(value, -last) or value, most)
        digits = min(most, max(LEAST_DIGITS, first - last + 1))
    elif error is not None:
        digits = most
    text, power = _plain(value, digits)
    if (not error or digits == most) and "." in text:  # trailing zeros carry no information
        text = text.rstrip("0").rstrip(".")
    return text + power


def _plain(value: float, digits: int) -> tuple[str, str]:
    """Return the number with this many digits, and the power of ten if one is needed to read it."""
    rounded = float(f"{value:.{digits}g}")
    exponent = _exponent(rounded, digits)
    if -4 <= exponent < 7:
        return f"{rounded:.{max(0, digits - 1 - exponent)}f}", ""
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    return mantissa, f"·10{str(int(power)).translate(POWERS)}"
