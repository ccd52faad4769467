"""Tests of the table of tangential loops: writing, reading, and refusals."""

import numpy as np
import pytest

from workflow.analyses.wear.output.loop_table import (
    COLUMNS,
    NEEDED,
    read_loop_table,
    write_loop_table,
)
from workflow.case.fields import Quantity
from workflow.case.files.table_file import read_table_file
from workflow.errors import UserError


def rows(count):
    numbers = np.random.default_rng(4).random((count, len(COLUMNS)))
    numbers[:, 1].sort()
    return [dict(zip(COLUMNS, row, strict=True)) for row in numbers]


@pytest.mark.parametrize("per_length", [False, True])
def test_table_reads_back_equal(tmp_path, per_length):
    path = tmp_path / "loops_face.csv"
    given = rows(5)
    write_loop_table(path, given, per_length)
    table, written = read_loop_table(path), read_table_file(path)
    assert table.per_length is per_length
    for name, column in COLUMNS.items():
        expected = [row[name] for row in given]
        numbers = written.column(name, Quantity(column.unit_in(per_length)))
        np.testing.assert_allclose(numbers, expected, rtol=1e-11)
        if name in NEEDED:
            np.testing.assert_array_equal(getattr(table, name), numbers)


def test_table_names_everyday_units(tmp_path):
    path = tmp_path / "loops_face.csv"
    write_loop_table(path, [dict.fromkeys(COLUMNS, 1000.0)])
    headings, first = path.read_text().splitlines()
    assert headings.startswith("cycles [1],energy [J],P [N],kt [N/mm],mu [1],energy_per_loop [mJ],")
    assert first.split(",")[:2] == ["1000", "1"]


def test_measured_tables_may_have_units_of_their_own(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text("mu,kt [N/um],energy [kJ],P\n0.5,26.5,0,60\n0.9,60,2.8,60\n\n")
    table = read_loop_table(path)
    np.testing.assert_allclose(table.kt, [26500.0, 60000.0])
    np.testing.assert_allclose(table.energy, [0.0, 2.8e6])
    np.testing.assert_allclose(table.mu, [0.5, 0.9])
    np.testing.assert_array_equal(table.sliding, 1.0)  # they do not say


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("energy,P,kt,mu\n", ":1: no rows"),
        ("energy,P,kt,mu,colour\n0,1,1,1,1\n", "'colour'"),
        ("energy,P,kt\n0,1,1\n", "mu"),
        ("energy,P,kt [s],mu\n0,1,1,1\n", "kt: "),
        ("energy,P,kt,mu\n2,1,1,1\n1,1,1,1\n", ":3: "),
    ],
)
def test_other_tables_are_refused_with_their_line(tmp_path, text, named):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(UserError) as refusal:
        read_loop_table(path)
    assert str(refusal.value).startswith(str(path))
    assert named in str(refusal.value)
