"""Units that are known without pint are exactly those of pint."""

from itertools import product

import pytest

from workflow.case import units

WRITTEN = (
    "kg/m^3",
    "t/mm^3",
    "um^3/J",
    "mm^3/J",
    "N*mm",
    "N/um",
    "rad/s",
    "m/s^2",
    "N*m/rad",
    "1/MPa",
    "1/N/mm",
)


def test_frequent_units_are_pints():
    """Alone, as powers, products and quotients, size (to all digits) and dimension agree."""
    names = list(units.FREQUENT)
    pairs = [f"{one}{sign}{other}" for one, other, sign in product(names, names, "*/")]
    for text in (*names, *(f"{name}^3" for name in names), *pairs, *WRITTEN):
        known, pints = units._frequent(text), units._by_pint(text)
        assert (float(known.factor), known.powers) == (float(pints.factor), pints.powers), text


@pytest.mark.parametrize(
    ("written", "plain"),
    [
        *((f"1 {rate}", "1e-3 1/MPa") for rate in (
            "mm^3/(N m)", "mm³/(N·m)", "mm³/(N*m)", "mm^3/N/m", "mm3/Nm", "mm**3 / (N * m)",
            "mm³/Nm", "mm^3/J", "mm³ / J", "mm^3 N^-1 m^-1",
        )),
        ("2 µm³/J", "2 um^3/J"),
        ("2 μm", "2 um"),
        ("7.85 g/cm³", "7850 kg/m^3"),
        ("3 kN·m", "3e6 N*mm"),
        ("3 kNm", "3e6 N*mm"),
        ("3 N mm", "3 N*mm"),
    ],
)  # fmt: skip
def test_spaces_dots_and_superscripts(written, plain):
    assert units.to_base(written, None) == units.to_base(plain, None)


def test_units_of_another_dimension_are_refused():
    with pytest.raises(units.UnitError, match="1/MPa"):
        units.to_base("1 mm^3", "1/MPa")
