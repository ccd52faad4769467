"""What public functions of matrices are given: sparse and dense ones, and what is none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from fe_models.matrices import (
    ExternalMatrices,
    FileUnits,
    GivenUnknowns,
    MatrixError,
    Unknown,
    check_definite,
    external_matrices,
    lowest_frequencies,
    on_all,
    on_retained,
    read_matrix_file,
    with_light_motions,
    without_massless,
    write_matrices,
)
from tests.given import NO_NUMBERS, assert_refused, held_otherwise, spoilt

COUNT = 6
NAMES = tuple(Unknown(str(k), "x") for k in range(COUNT))
STIFFNESS = 1024.0 * (2.0 * np.eye(COUNT) - np.eye(COUNT, k=1) - np.eye(COUNT, k=-1))
MASS = 0.5 * np.eye(COUNT)
LOADS = np.arange(2.0 * COUNT).reshape(COUNT, 2)
PLACES = np.arange(3.0 * COUNT).reshape(COUNT, 3)
FORMATS = ("csr", "csc", "coo", "lil", "dia", "dok")


def row(stiffness=STIFFNESS, mass=MASS, damping=None, loads=LOADS, **more):
    return ExternalMatrices(stiffness, mass, damping, loads, NAMES, **more)


MODEL = on_all(row())

# Of each entry a good field, and the numbers that it makes of it.
ENTRIES = {
    "stiffness": (STIFFNESS, lambda k: lowest_frequencies(row(stiffness=k), 3)),
    "mass": (MASS, lambda m: on_retained(row(mass=m), ["0", "5"], 2).frequencies),
    "damping": (STIFFNESS, lambda c: on_retained(row(damping=c), ["0", "5"], 2).damping),
    "loads": (LOADS, lambda f: on_retained(row(loads=f), ["0", "5"], 2).loads),
    "places": (PLACES, lambda x: on_retained(row(places=x), ["0", "5"], 2).places),
}
EVERY = pytest.mark.parametrize("entry", ENTRIES)


@EVERY
def test_numbers_count_and_not_how_they_are_held(entry):
    """Lists, single precision, columns first, whole numbers, and every format of sparse ones."""
    field, made = ENTRIES[entry]
    expected = made(field)
    forms = held_otherwise(field)
    if entry not in ("loads", "places"):
        forms += [sp.csr_matrix(field).asformat(name) for name in FORMATS]
    if entry == "stiffness":
        forms += [field.astype(int), sp.csr_matrix(field.astype(int)), sp.csr_array(field)]
    for given in forms:
        found = made(given)
        assert type(found) is np.ndarray
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)


@EVERY
@pytest.mark.parametrize(
    "kind", ["complex", "text", "flags", "none", "masked", "missing", "deep", "short", "skewed"]
)
def test_what_is_no_matrix_is_refused(entry, kind):
    field, made = ENTRIES[entry]
    if kind == "none" and entry in ("damping", "places"):
        return  # they may be left out
    if (entry in ("loads", "places") and kind == "skewed") or (
        entry == "places" and kind == "missing"
    ):
        return  # those of modes have none
    given = spoilt(field, kind)
    sparse = (
        [] if entry in ("loads", "places") else ["complex", "flags", "missing", "short", "skewed"]
    )
    for each in (given, *([sp.csr_matrix(given)] if kind in sparse else [])):
        with pytest.raises(MatrixError):
            made(each)


@pytest.mark.parametrize("value", NO_NUMBERS)
def test_what_is_no_number_is_refused(value):
    attempts = (
        lambda: FileUnits(length=value),
        lambda: FileUnits(force=value),
        lambda: FileUnits(mass=value),
        lambda: lowest_frequencies(row(), value),
        lambda: on_retained(row(), ["0"], value),
        lambda: with_light_motions(MODEL, value),
        lambda: check_definite(MODEL, {"0 x": value}),
    )
    assert_refused(MatrixError, attempts)


@pytest.mark.parametrize(
    "attempt",
    [
        lambda: FileUnits(length=0.0),
        lambda: FileUnits(force=-1.0),
        lambda: ExternalMatrices(STIFFNESS, MASS, None, LOADS, NAMES[:1] * COUNT),
        lambda: on_retained(row(), ["0", "6"], 1),
        lambda: on_retained(row(), "05", 1),
        lambda: on_retained(row(), ["0"], -1),
        lambda: lowest_frequencies(row(), 0),
        lambda: with_light_motions(MODEL, 0.0),
        lambda: external_matrices({"stifness": (Path("k.mtx"), "")}),
        lambda: external_matrices({}),
        lambda: GivenUnknowns(rows=NAMES, places=PLACES[1:]),
        lambda: GivenUnknowns(rows=NAMES, places=PLACES.T),
        lambda: read_matrix_file("matrices.doc"),
        lambda: write_matrices(MODEL, Path(), "row", ("npy",)),
    ],
)
def test_what_has_no_meaning_is_refused(attempt):
    with pytest.raises(MatrixError):
        attempt()


def test_a_model_without_names_or_mass_is_refused():
    for bare in (replace(MODEL, names=None), replace(MODEL, mass=None)):
        for attempt in (
            lambda model=bare: check_definite(model),
            lambda model=bare: without_massless(model),
            lambda model=bare: with_light_motions(model, 1e4),
            lambda model=bare: write_matrices(model, Path(), "row", ("npz",)),
        ):
            with pytest.raises(MatrixError):
                attempt()


def test_folders_may_be_texts(tmp_path):
    write_matrices(MODEL, str(tmp_path), "row", ("npz",))
    assert "stiffness" in read_matrix_file(str(tmp_path / "row.npz")).matrices
    back = external_matrices({}, str(tmp_path / "row.npz"))
    np.testing.assert_allclose(back.stiffness.toarray(), STIFFNESS)
