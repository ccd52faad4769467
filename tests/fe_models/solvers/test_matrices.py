"""Matrices of other programs: handwritten files of every format, refusals, units."""

import random
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.linalg as sl
import scipy.sparse as sp

from fe_models.joints.reduction import save_reduced
from fe_models.matrices import (
    ExternalMatrices,
    FileUnits,
    GivenUnknowns,
    MatrixError,
    Unknown,
    external_matrices,
    lowest_frequencies,
    on_all,
    read_matrix_file,
    write_matrices,
)
from tests.fe_models.readers.test_damaged_files import damaged
from tests.marks import slow

# Two nodes, the second of which turns too, and the load of 1 N on it.
STIFFNESS = np.array([[300.0, -100.0, 5.0], [-100.0, 100.0, -7.0], [5.0, -7.0, 40.0]])
MASS = np.diag([2e-3, 1e-3, 5e-4])
LOAD = np.array([[0.0], [1.0], [0.0]])
NAMES = "1 x", "2 x", "2 rz"
ROWS = tuple(Unknown(*name.split()) for name in NAMES)

MATRIX_INPUT = """\
1,1, 1,1,  3.000000000000000e+02
2,1, 1,1, -1.000000000000000e+02
2,6, 1,1,  5.000000000000000e+00
2,1, 2,1,  1.000000000000000e+02
2,6, 2,1, -7.000000000000000e+00
2,6, 2,6,  4.000000000000000e+01
"""
MASS_INPUT = "1,1, 1,1, 2.0e-03\n2,1, 2,1, 1.0e-03\n2,6, 2,6, 5.0D-04\n"
COORDINATE = """\
1     1     3.000000000000000e+02
2     1     -1.000000000000000e+02
1     2     -1.000000000000000e+02
3     1     5.000000000000000e+00
1     3     5.000000000000000e+00
2     2     1.000000000000000e+02
3     2     -7.000000000000000e+00
2     3     -7.000000000000000e+00
3     3     4.000000000000000e+01
"""
SUBSTRUCTURE = """\
**
** GENERATION OF SUBSTRUCTURE Z1
*USER ELEMENT, NODES=         2, LINEAR
** ELEMENT NODES
**          1,          2
          1
          2,          1,          6
*MATRIX,TYPE=STIFFNESS
  300.00000000000    ,
 -100.00000000000    ,  100.00000000000
  5.0000000000000    , -7.0000000000000    ,  40.000000000000
*MATRIX,TYPE=MASS
 0.20000000000000E-02,
 0.00000000000000E+00, 0.10000000000000E-02
 0.00000000000000E+00, 0.12345678901234-100, 0.50000000000000E-03
"""
PUNCH = """\
$TITLE   = EXTERNAL SUPERELEMENT
DMIG    KAAX           0       6       2       0
DMIG*   KAAX                           1               1
*                      1               1 3.000000000D+02
DMIG*   KAAX                           2               1
*                      1               1-1.000000000D+02
*                      2               1 1.000000000D+02
DMIG*   KAAX                           2               6
*                      1               1 5.000000000D+00
*                      2               1-7.000000000D+00
*                      2               6 4.000000000D+01
DMIG    MAAX           0       6       2       0
DMIG    MAAX           1       1               1       1   2.0-3
DMIG    MAAX           2       1               2       1   1.0-3
DMIG,MAAX,2,6,,2,6,5.0E-4
DMIG    PAX            0       9       2       0                       1
DMIG*   PAX                            1               0
*                      2               1 1.000000000D+00
"""


def the_matrices(own):
    """Check that a file contains the example."""
    np.testing.assert_allclose(own.stiffness.toarray(), STIFFNESS, rtol=1e-15)
    np.testing.assert_allclose(own.mass.toarray(), MASS, rtol=1e-15, atol=1e-90)
    assert [unknown.name for unknown in own.unknowns] == list(NAMES)
    return own


def own_of(stiffness, mass, unknowns=ROWS, **others):
    size = len(stiffness)
    unknowns = (
        unknowns if len(unknowns) == size else tuple(Unknown(f"{k}", "x") for k in range(size))
    )
    empty = {"damping": None, "loads": np.zeros((size, 0))}
    matrices = sp.csr_matrix(stiffness), sp.csr_matrix(mass)
    return ExternalMatrices(*matrices, **(empty | others), unknowns=unknowns)


# --- formats ------------------------------------------------------------------------------------


def npz(path):
    np.savez(path, K=STIFFNESS, M=MASS, F=LOAD)


def mat(path):
    scipy.io.savemat(path, {"k": STIFFNESS, "M": sp.csc_matrix(MASS), "f": LOAD})


def mat_73(path):
    """Write as Matlab's -v7.3: columns first, sparse matrices as groups, after 512 bytes."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("K", STIFFNESS), ("F", LOAD)):
            file[name] = values.T
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        sparse, group = sp.csc_matrix(MASS), file.create_group("M")
        group.attrs.update({"MATLAB_sparse": 3, "MATLAB_class": np.bytes_("double")})
        group.update({"data": sparse.data, "ir": sparse.indices, "jc": sparse.indptr})


def hdf5(path):
    sparse = sp.csr_matrix(STIFFNESS)
    with h5py.File(path, "w") as file:
        parts = {"data": sparse.data, "indices": sparse.indices, "indptr": sparse.indptr}
        file.create_group("K").update(parts)
        file.update({"M": MASS, "F": LOAD[:, 0]})


def op4(path):
    written = pytest.importorskip("pyyeti.nastran.op4")
    matrices = [STIFFNESS, sp.coo_matrix(MASS), LOAD]
    written.write(str(path), ["KAA", "MAA", "PA"], matrices, binary=path.stem == "binary")


@pytest.mark.parametrize(
    ("write", "name"),
    [
        *((npz, "a.npz"), (mat, "a.mat"), (mat_73, "a.mat"), (hdf5, "a.h5")),
        # The import of pyYeti takes 3 s.
        *(slow(op4, name) for name in ("a.op4", "binary.op4")),
    ],
)
def test_files_of_arrays(tmp_path, write, name):
    write(tmp_path / name)
    own = the_matrices(external_matrices({}, tmp_path / name, GivenUnknowns(ROWS)))
    np.testing.assert_array_equal(own.loads, LOAD)
    with pytest.raises(MatrixError, match=r"3 rows .* unknowns"):
        external_matrices({}, tmp_path / name)


@pytest.mark.parametrize("layout", ["coordinate", "array"])
def test_matrix_market_and_sparse_npz(tmp_path, layout):
    stiffness = sp.coo_matrix(STIFFNESS) if layout == "coordinate" else STIFFNESS
    scipy.io.mmwrite(tmp_path / "k.mtx", stiffness, symmetry="symmetric")
    sp.save_npz(tmp_path / "m.npz", sp.csr_matrix(MASS))
    sources = {"stiffness": (tmp_path / "k.mtx", ""), "mass": (tmp_path / "m.npz", "")}
    the_matrices(external_matrices(sources, given=GivenUnknowns(ROWS)))


def write_texts(folder, **texts):
    """Write files of one text each; return them by part, as sources."""
    for part, text in texts.items():
        (folder / f"{part}.mtx").write_text(text, encoding="utf-8")
    return {part: (folder / f"{part}.mtx", "") for part in texts}


def test_abaqus_matrix_input(tmp_path):
    sources = write_texts(tmp_path, stiffness=MATRIX_INPUT, mass=MASS_INPUT, loads="2,1, 1.0\n")
    own = the_matrices(external_matrices(sources))
    np.testing.assert_array_equal(own.loads, LOAD)


def test_displacements_that_abaqus_holds_are_none(tmp_path):
    held = "3,2, 1,1, 8.0\n3,2, 3,2, 1.0e+36\n"
    sources = write_texts(
        tmp_path, stiffness=MATRIX_INPUT + held, mass=f"{MASS_INPUT}3,2, 3,2, 1.0\n"
    )
    own = the_matrices(external_matrices(sources))
    assert own.held == (Unknown("3", "y"),)
    sources = write_texts(tmp_path, stiffness=COORDINATE + "4 4 1e36\n", mass=COORDINATE)
    with pytest.raises(MatrixError, match="row 4 is held by 1e36"):
        external_matrices(sources, given=GivenUnknowns(ROWS))


def test_abaqus_coordinates_have_one_triangle_or_both(tmp_path):
    mass = "1 1 2e-3\n2 2 1e-3\n3 3 5e-4\n"
    lower = "\n".join(
        line for line in COORDINATE.splitlines() if int(line.split()[0]) >= int(line.split()[1])
    )
    for stiffness in (COORDINATE, lower):
        sources = write_texts(tmp_path, stiffness=stiffness, mass=mass, loads="2 1.0\n3 0.0\n")
        own = the_matrices(external_matrices(sources, given=GivenUnknowns(ROWS)))
        np.testing.assert_array_equal(own.loads, LOAD)


def test_an_abaqus_substructure(tmp_path):
    (tmp_path / "z1.mtx").write_text(SUBSTRUCTURE, encoding="utf-8")
    the_matrices(external_matrices({}, tmp_path / "z1.mtx"))


def test_a_nastran_punch_file(tmp_path):
    (tmp_path / "se.pch").write_text(PUNCH, encoding="utf-8")
    own = the_matrices(external_matrices({}, tmp_path / "se.pch"))
    np.testing.assert_array_equal(own.loads, LOAD)
    assert own.taken == {"stiffness": "KAAX", "mass": "MAAX", "loads": "PAX"}


@pytest.mark.slow
def test_pyyeti_reads_the_same_punch_file(tmp_path):
    """Compare with an independent reader."""
    bulk = pytest.importorskip("pyyeti.nastran.bulk")
    (tmp_path / "se.pch").write_text(PUNCH, encoding="utf-8")
    read = bulk.rddmig(str(tmp_path / "se.pch"))
    np.testing.assert_array_equal(read["kaax"].to_numpy(), STIFFNESS)


def test_scalar_points_of_nastran_are_modes_and_come_with_nodes(tmp_path):
    text = PUNCH.replace(
        "DMIG    MAAX           0", "DMIG,KAAX,101,0,,101,0,4.0E+6\nDMIG    MAAX           0", 1
    )
    (tmp_path / "se.pch").write_text(f"{text}DMIG,MAAX,101,,,101,,1.0\n", encoding="utf-8")
    own = external_matrices({}, tmp_path / "se.pch")
    assert own.unknowns[-1] == Unknown("101", "modal")
    assert on_all(own).frequencies == pytest.approx([2000.0 / (2.0 * np.pi)])


def test_without_pyyeti_op4_names_the_package_to_install(tmp_path, monkeypatch):
    (tmp_path / "a.op4").write_text("", encoding="utf-8")
    monkeypatch.setitem(sys.modules, "pyyeti.nastran", None)
    with pytest.raises(MatrixError, match=r"pip install 'fretscale\[nastran\]'"):
        read_matrix_file(tmp_path / "a.op4")


def test_nodes_are_given_names(tmp_path):
    sources = write_texts(tmp_path, stiffness=MATRIX_INPUT, mass=MASS_INPUT)
    given = GivenUnknowns(nodes={"2": "tip 1"}, places={"tip 1": np.array([1.0, 2.0, 3.0])})
    own = external_matrices(sources, given=given)
    assert own.unknowns[1:] == (Unknown("tip 1", "x"), Unknown("tip 1", "rz"))
    np.testing.assert_array_equal(own.places[1], [1.0, 2.0, 3.0])
    with pytest.raises(MatrixError, match="node 7: not in the matrices"):
        external_matrices(sources, given=GivenUnknowns(nodes={"7": "tip"}))


@pytest.mark.parametrize("ending", ["npz", "mat", "h5", "mtx"])
def test_a_reduced_model_comes_back(tmp_path, ending):
    modal = own_of(sl.block_diag(STIFFNESS, 4e6), sl.block_diag(MASS, 1.0))
    unknowns = (*ROWS, Unknown("mode 1", "modal"))
    model = on_all(replace(modal, unknowns=unknowns, loads=np.ones((4, 2)) / 3.0))
    model = replace(model, places=np.arange(9.0).reshape(3, 3) / 7.0, damping=model.stiffness / 3e3)
    if ending == "h5":
        save_reduced(tmp_path / "body.h5", model)
    else:
        write_matrices(model, tmp_path, "body", (ending,))
    if ending == "mtx":
        parts = "stiffness", "mass", "damping", "loads"
        sources = {part: (tmp_path / f"body_{part}.mtx", "") for part in parts}
        back = on_all(external_matrices(sources, given=GivenUnknowns(unknowns)))
    else:
        back = on_all(external_matrices({}, tmp_path / f"body.{ending}"))
        np.testing.assert_array_equal(back.places, model.places)
    for name in ("stiffness", "mass", "damping", "loads"):
        np.testing.assert_array_equal(getattr(back, name), getattr(model, name))
    assert back.names == model.names


# --- damage -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "text"),
    [
        *(("a.mtx", text) for text in (MATRIX_INPUT, COORDINATE, SUBSTRUCTURE)),
        ("a.mtx", "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 3.5\n2 2 1e3\n"),
        ("a.pch", PUNCH),
    ],
)
def test_damaged_texts_end_in_one_line(tmp_path, name, text):
    chance, path, refusals = random.Random(5), tmp_path / name, []
    for _ in range(40):
        path.write_text(damaged(text, chance), encoding="utf-8")
        try:
            external_matrices({}, path, GivenUnknowns(ROWS) if text == COORDINATE else None)
        except MatrixError as error:
            refusals.append(str(error))
    assert all("\n" not in line and len(line) < 400 for line in refusals)
    assert len(refusals) > 10


@pytest.mark.parametrize(("write", "name"), [(npz, "a.npz"), (mat, "a.mat"), (hdf5, "a.h5")])
def test_damaged_arrays_end_in_one_line(tmp_path, write, name):
    path = tmp_path / name
    write(path)
    whole, chance, refusals = path.read_bytes(), random.Random(5), []
    for _ in range(20):
        at, gone = chance.randrange(len(whole)), chance.randrange(1, 40)
        path.write_bytes(whole[:at] + chance.randbytes(gone) + whole[at + gone :])
        try:
            external_matrices({}, path, GivenUnknowns(ROWS))
        except MatrixError as error:
            refusals.append(str(error))
    assert not any("\n" in line for line in refusals)
    path.write_bytes(whole[:40])
    with pytest.raises(MatrixError, match="cannot be read"):
        external_matrices({}, path, GivenUnknowns(ROWS))


# --- checks -------------------------------------------------------------------------------------


def saved(path, **matrices):
    np.savez(path, **({"K": STIFFNESS, "M": MASS} | matrices))
    return path


def changed(matrix, row, column, value):
    other = np.array(matrix, dtype=type(value))
    other[row, column] = value
    return other


@pytest.mark.parametrize(
    ("matrices", "part"),
    [
        ({"M": np.eye(2)}, "unknowns"),
        ({"K": np.ones((3, 2))}, "stiffness"),
        ({"K": changed(STIFFNESS, 0, 1, -90.0)}, "stiffness"),
        ({"K": np.tril(STIFFNESS)}, "stiffness"),
        ({"M": changed(MASS, 1, 1, np.nan)}, "mass"),
        ({"K": STIFFNESS * (1.0 + 0.02j)}, "stiffness"),
        ({"M": np.array(["a"])}, "mass"),
    ],
)
def test_wrong_matrices_are_refused(tmp_path, matrices, part):
    path = saved(tmp_path / "a.npz", **matrices)
    with pytest.raises(MatrixError) as refusal:
        external_matrices({}, path, GivenUnknowns(ROWS))
    assert refusal.value.part == part


def test_rounding_is_no_asymmetry(tmp_path):
    path = saved(tmp_path / "a.npz", K=changed(STIFFNESS, 0, 1, -100.0 * (1.0 + 1e-9)))
    own = external_matrices({}, path, GivenUnknowns(ROWS))
    assert own.stiffness[0, 1] == own.stiffness[1, 0] == pytest.approx(-100.0 * (1.0 + 5e-10))


# --- units --------------------------------------------------------------------------------------


def beam(length, bending, mass):
    """Return stiffness and mass of a clamped beam of two elements, deflections and rotations.

    Source: Przemieniecki, Theory of Matrix Structural Analysis, 5.6 and 11.5; ``mass`` is per
    length.
    """
    a = length
    k = np.array([[12, 6 * a, -12, 6 * a], [6 * a, 4 * a**2, -6 * a, 2 * a**2]])
    k = np.vstack([k, -k[0], [6 * a, 2 * a**2, -6 * a, 4 * a**2]]) * bending / a**3
    m = [[156, 22 * a, 54, -13 * a], [22 * a, 4 * a**2, 13 * a, -3 * a**2]]
    m = np.array([*m, [54, 13 * a, 156, -22 * a], [-13 * a, -3 * a**2, -22 * a, 4 * a**2]])
    K, M = np.zeros((6, 6)), np.zeros((6, 6))
    for first in (0, 2):
        place = np.ix_(range(first, first + 4), range(first, first + 4))
        K[place] += k
        M[place] += m * mass * a / 420.0
    return K[2:, 2:], M[2:, 2:]


def test_a_beam_in_metres_is_the_same_beam(tmp_path):
    """Check deflections, rotations and a modal coordinate, with K in N/m, N and N m."""
    # Steel, 10 x 10 mm, elements of 100 mm: E I [N m²], and kg/m.
    K, M = beam(0.1, 210e9 * 1e-8 / 12.0, 0.785)
    in_mm = beam(100.0, 210e3 * 1e4 / 12.0, 7.85e-7)
    C, F = 2e-5 * K, np.eye(5, 2, k=-2)
    path = tmp_path / "beam.npz"
    bordered = [np.pad(matrix, (0, 1)) for matrix in (K, M, C)]
    bordered[0][4, 4], bordered[1][4, 4], bordered[1][4, 0] = 4e6, 1.0, 0.03
    bordered[1][0, 4] = 0.03
    np.savez(path, **dict(zip("KMCF", (*bordered, F), strict=True)))
    names = ("1", "y"), ("1", "rz"), ("2", "y"), ("2", "rz"), ("mode 1", "modal")
    given = GivenUnknowns(tuple(Unknown(*name) for name in names))
    own = external_matrices({}, path, given, FileUnits(length=1000.0))
    for matrix, expected in zip((own.stiffness, own.mass), in_mm, strict=True):
        np.testing.assert_allclose(matrix.toarray()[:4, :4], expected, rtol=1e-12)
    np.testing.assert_allclose(own.damping.toarray()[:4, :4], 2e-5 * in_mm[0], rtol=1e-12)
    assert own.mass[4, 4] == pytest.approx(1.0)
    assert own.stiffness[4, 4] == pytest.approx(4e6)
    # 1 N moves the tip by L³/(3 E I), a moment of 1 N m by L²/(2 E I), in mm.
    moved = np.linalg.solve(own.stiffness.toarray(), own.loads)
    bending = 210e3 * 1e4 / 12.0
    assert moved[2, 0] == pytest.approx(200.0**3 / (3.0 * bending), rel=1e-12)
    assert moved[2, 1] == pytest.approx(1e3 * 200.0**2 / (2.0 * bending), rel=1e-12)
    squares = sl.eigh(*bordered[:2], eigvals_only=True)
    frequencies = np.sqrt(squares) / (2.0 * np.pi)
    np.testing.assert_allclose(lowest_frequencies(own, 5), frequencies, rtol=1e-12)


def test_kilograms_with_newtons_and_millimetres():
    assert FileUnits(1.0, 1.0, 1e-3).mass == 1e-3
    assert FileUnits(1.0, 1e3).mass == pytest.approx(1e3)
