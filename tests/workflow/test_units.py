"""Units: those known without pint are exactly what pint makes of them."""

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
    """Alone, to a power, in products and quotients: size to all digits of a number, dimension."""
    names = list(units.FREQUENT)
    pairs = [f"{one}{sign}{other}" for one, other, sign in product(names, names, "*/")]
    for text in (*names, *(f"{name}^3" for name in names), *pairs, *WRITTEN):
        known, pints = units._frequent(text), units._by_pint(text)
        assert (float(known.factor), known.powers) == (float(pints.factor), pints.powers), text


@pytest.mark.parametrize(
    "text", ["furlong", "mm^0", "mm^-1", "mm mm", "(N/mm)", "N/(mm/s)", "N//mm", "mmm"]
)
def test_anything_else_is_left_to_pint(text):
    assert units._frequent(text) is None
