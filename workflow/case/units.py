"""Conversion of texts such as ``115 GPa`` to the base units mm, N, s, MPa, tonne, rad.

No other module knows other units. Conversion is in decimal arithmetic, so that ``115 GPa`` is
exactly 115000.0. Angles count as a separate dimension: ``45 %`` is not an angle, and ``100 Hz`` is
not a rotation speed.
"""

from __future__ import annotations

import difflib
import re
from decimal import Decimal
from functools import cache
from math import prod
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pint import UnitRegistry

QUANTITY_PATTERN = r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*$"
# The same for editors, which check only that there is a unit.
ABOVE_ZERO_WITH_UNIT = (
    r"^\s*\+?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*(?:1\s*/\s*)?[A-Za-zµμ°%(].*$"
)
WITH_UNIT = ABOVE_ZERO_WITH_UNIT.replace(r"\+?", "[-+]?", 1)
LONGEST_UNIT = 40  # no unit is longer; keeps pint from chewing on prose

# Units in which nearly every case is written, with their size in root units and their dimension.
# Pint knows all others but takes a third of a second to load; a test compares these with it.
RADIAN, METER, GRAM, SECOND = "radian", "meter", "gram", "second"
LENGTH, MASS, TIME, ANGLE = {METER: 1}, {GRAM: 1}, {SECOND: 1}, {RADIAN: 1}
FREQUENCY = {SECOND: -1}
FORCE = {GRAM: 1, METER: 1, SECOND: -2}
STRESS = {GRAM: 1, METER: -1, SECOND: -2}
ENERGY = {GRAM: 1, METER: 2, SECOND: -2}
FREQUENT: dict[str, tuple[str, dict[str, int]]] = {
    "m": ("1", LENGTH),
    "mm": ("1e-3", LENGTH),
    "um": ("1e-6", LENGTH),
    "nm": ("1e-9", LENGTH),
    "g": ("1", MASS),
    "kg": ("1e3", MASS),
    "t": ("1e6", MASS),
    "s": ("1", TIME),
    "ms": ("1e-3", TIME),
    "us": ("1e-6", TIME),
    "kHz": ("1e3", FREQUENCY),
    "N": ("1e3", FORCE),
    "mN": ("1", FORCE),
    "kN": ("1e6", FORCE),
    "MN": ("1e9", FORCE),
    "Pa": ("1e3", STRESS),
    "kPa": ("1e6", STRESS),
    "MPa": ("1e9", STRESS),
    "GPa": ("1e12", STRESS),
    "J": ("1e3", ENERGY),
    "uJ": ("1e-3", ENERGY),
    "mJ": ("1", ENERGY),
    "kJ": ("1e6", ENERGY),
    "MJ": ("1e9", ENERGY),
    "h": ("3600", TIME),
    "rad": ("1", ANGLE),
    "deg": ("0.01745329251994329576923690768", ANGLE),
    "rpm": ("0.1047197551196597746154214461", {RADIAN: 1, SECOND: -1}),
    "%": ("1e-2", {}),
    "Hz": ("1", FREQUENCY),
}
# Other spellings of frequent units: superscripts, dots, spaces, and newtons times lengths.
SPELLINGS = (
    ("²", "^2"),
    ("³", "^3"),
    (r"[µμ](?=m)", "u"),
    (r"\*\*", "^"),
    (r"(?<![A-Za-z])([cmu]?m)([23])\b", r"\1^\2"),
    (r"\s*([/*()])\s*", r"\1"),
    (r"\s*[·⋅]\s*|\s+", "*"),
    (r"(?<![A-Za-z])([kM]?N)(mm?)(?![A-Za-z^])", r"(\1*\2)"),  # Nm, which pint takes for a yarn's
)
BELOW = re.compile(r"/[^()/]*[*·⋅ ]")  # mm³/N·m, which is (mm³/N)·m
FACTOR_PATTERN = re.compile(r"(?P<unit>[A-Za-z%]+)(?:\^(?P<power>[1-9]))?")

# Suggested when a unit is not known; pint knows many more.
COMMON_UNITS = (
    *("mm", "um", "m", "N", "kN", "MPa", "GPa", "Pa", "kg", "g", "t", "s", "h", "J", "mJ"),
    *("deg", "rad", "rpm", "rad/s", "%", "kg/m^3", "N*m"),
    *("um^3/J", "mm^3/J", "mm^3/(N*m)", "1/MPa"),
)


class UnitError(ValueError):
    """Text that is not a quantity, or not one of the wanted dimension."""


class _Unit(NamedTuple):
    factor: Decimal  # size in root units
    powers: dict[str, Decimal]  # of the root units meter, gram, second, radian, ...


def to_base(text: str, unit: str | None) -> float:
    """Return ``text`` as a number in the base unit ``unit``.

    For ``unit`` ``None`` any dimension is accepted, for ``"1"`` a ratio such as ``2 %``. Raises
    ``UnitError``.
    """
    number, written = split(text)
    known = _parse(written)
    if unit is None:
        return float(number * known.factor / _base_factor(known.powers))
    wanted = _parse(unit)
    if known.powers != wanted.powers:
        target = "a ratio" if unit == "1" else unit
        hint = "; use brackets for all that is below /" if BELOW.search(written) else ""
        raise UnitError(f"unit '{written}' cannot be converted to {target}{hint}")
    return float(number * known.factor / wanted.factor)


def split(text: str) -> tuple[Decimal, str]:
    """Return number and unit of ``text``; raise ``UnitError`` if one of them is missing."""
    match = re.match(QUANTITY_PATTERN, text)
    if match is None:
        raise UnitError("not a number with a unit")
    number, unit = match.groups()
    if unit is None:
        raise UnitError("text without a unit")
    if re.match(r",\d", unit):
        raise UnitError("decimal comma; write a point")
    if power := re.match(r"[×x*·]\s*10(?:\^|\*\*)\s*([-+]?\d+)", unit):
        raise UnitError(f"power of ten; write {number}e{power[1]}")
    return Decimal(number), unit


def _base_factor(powers: dict[str, Decimal]) -> Decimal:
    """Return the size in root units of the base unit of a dimension: mm and tonne, not m and g."""
    base = {"meter": Decimal("1e-3"), "gram": Decimal("1e6")}
    one = Decimal(1)
    return prod((base.get(root, one) ** power for root, power in powers.items()), start=one)


@cache
def _parse(unit: str) -> _Unit:
    """Return factor and dimension of ``unit``; raise ``UnitError`` if it is unknown."""
    if len(unit) > LONGEST_UNIT:
        raise UnitError("not a number with a unit")
    if unit == "1":
        return _Unit(Decimal(1), {})
    plain = unit
    for pattern, replacement in SPELLINGS:
        plain = re.sub(pattern, replacement, plain)
    return _frequent(plain) or _by_pint(unit)


def _frequent(unit: str) -> _Unit | None:
    """Return a product or quotient of frequent units, such as kg/m^3; None for any other."""
    factor, powers = Decimal(1), dict[str, Decimal]()
    unit = re.sub(r"/\(([^()*/]+)\*([^()*/]+)\)", r"/\1/\2", unit)  # 1/(N*mm) is 1/N/mm
    unit = re.sub(r"^\(([^()*/]+)\*([^()*/]+)\)", r"\1*\2", unit)
    for place, part in enumerate(re.split(r"([*/])", f"*{unit}")[1:]):
        if place % 2 == 0:
            sign = 1 if part == "*" else -1
            continue
        if part == "1" and place == 1:
            continue
        match = FACTOR_PATTERN.fullmatch(part)
        if match is None or match["unit"] not in FREQUENT:
            return None
        size, dimension = FREQUENT[match["unit"]]
        power = sign * int(match["power"] or 1)
        factor *= Decimal(size) ** power
        for root, exponent in dimension.items():
            powers[root] = powers.get(root, Decimal(0)) + power * exponent
    return _Unit(factor, {root: power for root, power in powers.items() if power})


def _by_pint(unit: str) -> _Unit:
    """Return factor and dimension according to pint; raise ``UnitError`` if it is unknown."""
    registry = _registry()
    try:
        parsed = registry.parse_units(unit)
        # Temperature scales and decibels have no factor; multiplying them is an error in pint.
        _ = registry.Quantity(Decimal(1), parsed) * registry.Quantity(Decimal(1), "meter")
        factor, root = registry.get_root_units(parsed)
    except Exception as error:  # pint raises a dozen kinds, from its tokenizer's to decimal's
        raise UnitError(_unknown(unit)) from error
    powers = {name: Decimal(str(power)) for name, power in root._units.items()}
    return _Unit(Decimal(str(factor)), powers)


def _unknown(unit: str) -> str:
    near = difflib.get_close_matches(unit.lower(), [u.lower() for u in COMMON_UNITS], n=1)
    hint = [u for u in COMMON_UNITS if near and u.lower() == near[0]]
    return f"unknown unit '{unit}'" + (f", did you mean '{hint[0]}'?" if hint else "")


@cache
def _registry() -> UnitRegistry:
    """Return pint's registry, built on first use because importing and building it takes 0.6 s."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)
