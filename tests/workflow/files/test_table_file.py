"""One CSV dialect for tables of loops, records of loops and recorded forces."""

import numpy as np
import pytest

from workflow.analyses.rig.excitation import RECORDED, Recorded
from workflow.analyses.wear.output.loop_table import read_loop_table
from workflow.case.fields import Quantity
from workflow.case.files.input_files import InputFileError
from workflow.case.files.loop_file import read_loop_file
from workflow.case.files.table_file import read_table_file

# A byte-order mark, comments before and among the rows, empty lines, quotes, spaces and units.
AWKWARD = (
    '\ufeff# rig 1, 20 \xb0C\r\n\r\n"{}" , {}{}\r\n 0.5 ,2{}\r\n  # paused, "here\r\n1,"3"{}\r\n'
)


def awkward(path, first, second, more=("", "", ""), how=("utf-8", True)):
    encoding, marked = how
    text = AWKWARD.format(first, second, *more)
    path.write_bytes((text if marked else text[1:]).encode(encoding))
    return path


ENCODINGS = [("utf-8", True), ("utf-16-le", True), ("utf-16-be", True)]
ENCODINGS += [("utf-8", False), ("utf-16-le", False), ("utf-16-be", False), ("latin-1", False)]


@pytest.mark.parametrize("how", ENCODINGS)
def test_every_reader_takes_the_same_files(how, tmp_path):
    more = (",P,mu", ",1,1", ",1,1")
    path = awkward(tmp_path / "loops.csv", "energy [J]", "kt [N/um]", more, how)
    table = read_loop_table(path)
    np.testing.assert_allclose(table.energy, [500.0, 1000.0], rtol=1e-15)
    np.testing.assert_allclose(table.kt, [2e3, 3e3], rtol=1e-15)
    path = awkward(tmp_path / "record.csv", "displacement [µm]", "force [kN]", ("",) * 3, how)
    record = read_loop_file(path, {})
    np.testing.assert_allclose(record["displacement"], [5e-4, 1e-3], rtol=1e-15)
    np.testing.assert_allclose(record["force"], [2e3, 3e3], rtol=1e-15)
    path = awkward(tmp_path / "force.csv", "time [ms]", "force [kN]", ("",) * 3, how)
    times, force = Recorded(kind="recorded", file=str(path)).read()
    np.testing.assert_allclose(times, [5e-4, 1e-3], rtol=1e-15)
    np.testing.assert_allclose(force, [2e3, 3e3], rtol=1e-15)


# Records of 0.5 um and 1 um at 2 kN and -3 kN, as programs of several languages and makers write.
RECORDS = [
    "displacement (µm);force (kN)\r\n0,5;2\r\n1,0;-3,0e0\r\n",
    "displacement in µm\tforce in kN\n0.5\t2\n1\t-3\n",
    "displacement / µm, force / kN, channel (left)\n0.5, 2, 1\n1, -3, 1\n",
    '"displacement [µm]","force [kN]"\n"0.5","2"\n"1","-3"\n',
]


@pytest.mark.parametrize("text", RECORDS)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_records_have_the_units_that_their_program_wrote(text, encoding, tmp_path):
    path = tmp_path / "record.csv"
    path.write_bytes(text.encode(encoding))
    record = read_loop_file(path, {})
    np.testing.assert_allclose(record["displacement"], [5e-4, 1e-3], rtol=1e-15)
    np.testing.assert_allclose(record["force"], [2e3, -3e3], rtol=1e-15)


def forces(path):
    table = read_table_file(path)
    table.require(["force"], "both")
    return table.column("force", RECORDED["force"])


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("# nothing\n\ntime,force\n", ":3: "),
        ("# a\ntime\n1\n", ":2: no column force"),
        ("time,force,force\n1,2,3\n", ":1: force: "),
        ("time,force [s]\n1,2\n", ":1: force: unit 's'"),
        ("time,force\n1,2\n#\n\n1,2,3\n", ":5: "),
        ("time,force\n1,two\n", ":2: force: 'two'"),
        ("time\tforce\n1,5\t2,5\n", ":2: force: 2,5"),
        ("time,force (MN)\n1,2\n1,2e9\n", ":3: force: 2e9"),
        ("time,force\n1,inf\n", ":2: force: inf"),
    ],
)
def test_an_error_in_a_table_has_its_line(tmp_path, text, place):
    path = tmp_path / "force.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputFileError) as refusal:
        forces(path)
    assert str(refusal.value).startswith(f"{path}{place}")


def test_a_ratio_may_be_in_percent(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("mu [%]\n50\n", encoding="utf-8")
    assert read_table_file(path).column("mu", Quantity("1")).tolist() == [0.5]


@pytest.mark.parametrize("units", ["um,kN,-", "[um],[kN],", "(um), (kN), -"])
def test_units_may_be_in_a_second_row(tmp_path, units):
    path = tmp_path / "record.csv"
    path.write_text(f"displacement,force,note\n{units}\n0.5,2,a\n1,3,b\n", encoding="utf-8")
    record = read_loop_file(path, {})
    np.testing.assert_allclose(record["displacement"], [5e-4, 1e-3], rtol=1e-15)
    np.testing.assert_allclose(record["force"], [2e3, 3e3], rtol=1e-15)
