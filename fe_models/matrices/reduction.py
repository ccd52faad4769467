"""Reduced models of own matrices: on retained points and modes, or on all unknowns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg as sl

from fe_models.joints.reduction import ReducedModel, free_frequencies, reduce_body
from fe_models.matrices.structure import ExternalMatrices
from fe_models.matrices.unknowns import MODAL, ROTATIONS, MatrixError, Unknown, listed_names
from fe_models.solvers.linear_solver import FactorMemoryError, SolverError
from sa_solver import checks
from sa_solver.types import Array, Indices

# Masses below this share of the largest of their kind (displacements, rotations) count as 0.
MASSLESS = 1e-13
NOTHING: Mapping[str, float] = {}
# For matrices scaled to 1 on their diagonal: a stiffness has negative eigenvalues below -NEGATIVE
# (rounding to single precision gives rigid motions smaller ones), and a mass with eigenvalues up to
# SINGULAR is not definite.
NEGATIVE, SINGULAR = 1e-6, 1e-10
# A body has at most MOST_RIGID rigid motions. Their frequencies are below the share RIGID of the
# next one, and the squares of these below the share ROUNDING of the median of K_jj/M_jj, as for a
# stiffness with nine digits.
MOST_RIGID, RIGID, ROUNDING = 6, 1e-3, 1e-8
# Number of unknowns up to which all frequencies are computed.
DENSE = 600


def on_all(matrices: ExternalMatrices) -> ReducedModel:
    """Return the matrices unchanged as a dense model, with coordinates of modes after all others.

    Examples
    --------
    A mass on a spring, and a mode of a superelement:

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models.matrices import ExternalMatrices, Unknown, on_all
    >>> unknowns = Unknown("mode 1", "modal"), Unknown("tip", "x")
    >>> K, M = sp.diags([4e6, 1e3]).tocsr(), sp.diags([1.0, 1e-3]).tocsr()
    >>> model = on_all(ExternalMatrices(K, M, None, np.zeros((2, 0)), unknowns))
    >>> print(model.names, model.frequencies.round(1), model.static_stiffness)
    ('tip x',) [318.3] [[1000.]]
    """
    unknowns = matrices.unknowns
    modal = np.array([unknown.direction == MODAL for unknown in unknowns], dtype=bool)
    order: Indices = np.concatenate([np.flatnonzero(~modal), np.flatnonzero(modal)])
    K, M = (
        matrix.toarray()[np.ix_(order, order)] for matrix in (matrices.stiffness, matrices.mass)
    )
    damping = matrices.damping
    kept = order[: int((~modal).sum())]
    squares = np.diag(K)[len(kept) :] / np.where(np.diag(M) > 0.0, np.diag(M), np.inf)[len(kept) :]
    return ReducedModel(
        kept=kept,
        stiffness=K,
        mass=M,
        loads=matrices.loads[order],
        mode_shapes=np.zeros((len(unknowns), int(modal.sum()))),
        frequencies=np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi),
        names=tuple(unknowns[k].name for k in kept),
        places=None if matrices.places is None else matrices.places[kept],
        damping=None if damping is None else damping.toarray()[np.ix_(order, order)],
    )


def on_retained(
    matrices: ExternalMatrices,
    points: Sequence[str],
    modes: int,
    done: Callable[[], None] = lambda: None,
) -> ReducedModel:
    """Return the reduced model on the unknowns of ``points`` and ``modes``, by Craig and Bampton.

    Damping and loads are projected onto the same shapes. ``done`` is called as by
    :func:`~fe_models.joints.reduction.reduce_body`. Raises :class:`MatrixError` if there are fewer
    modes, and if other unknowns can move while the points are held.

    Examples
    --------
    Eleven masses and ten springs in a row are reduced to the ends and one mode, whose frequency is
    that of 2 √(k/m) sin(π/22):

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models.matrices import ExternalMatrices, Unknown, on_retained
    >>> K = 1e3 * sp.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(11, 11)).tolil()
    >>> K[0, 0] = K[10, 10] = 1e3
    >>> names = tuple(Unknown(str(k), "x") for k in range(11))
    >>> row = ExternalMatrices(K.tocsr(), 1e-3 * sp.identity(11, format="csr"), None,
    ...                   np.zeros((11, 0)), names)
    >>> model = on_retained(row, ["0", "10"], modes=1)
    >>> print(model.names, model.static_stiffness.round(6)[0], model.frequencies.round(3))
    ('0 x', '10 x') [ 100. -100.] [49.795]
    """
    unknowns = matrices.unknowns
    wanted = {points} if isinstance(points, str) else set(points)
    if missing := sorted(wanted - {unknown.point for unknown in unknowns}):
        raise MatrixError(
            f"{listed_names(missing)}: no points of the matrices; allowed: those", "retained"
        )
    if checks.whole("modes", modes, MatrixError) < 0:
        raise MatrixError(f"{modes} modes; allowed: 0 or more", "modes")
    kept: Indices = np.flatnonzero([u.point in wanted and u.direction != MODAL for u in unknowns])
    moving = int((matrices.mass.diagonal() > 0.0).sum()) - int(
        (matrices.mass.diagonal()[kept] > 0.0).sum()
    )
    if modes >= max(moving, 1):
        raise MatrixError(
            f"{modes} modes of {moving} displacements with mass that are not retained; allowed: "
            "fewer modes than displacements",
            "modes",
        )
    try:
        model = reduce_body(
            matrices.stiffness,
            matrices.mass,
            kept,
            modes,
            matrices.loads,
            done,
            matrices.damping,
        )
    except FactorMemoryError:
        raise
    except SolverError as error:
        raise MatrixError(
            f"unknowns that are not retained can move while the points are held ({error}); "
            "allowed: points that hold them, and no unknowns without stiffness",
            "retained",
        ) from error
    return replace(
        model,
        names=tuple(unknowns[k].name for k in kept),
        places=None if matrices.places is None else matrices.places[kept],
    )


def require_names(model: ReducedModel) -> None:
    """Raise :class:`MatrixError` unless a model has mass, and a name for each kept displacement."""
    if model.mass is None:
        raise MatrixError("a model without mass; allowed: one reduced with its mass", "mass")
    if model.names is None or len(model.names) != len(model.kept):
        raise MatrixError("a model whose displacements have no names; allowed: a name for each")


def without_massless(
    model: ReducedModel, laden: Sequence[str] = ()
) -> tuple[ReducedModel, tuple[str, ...]]:
    """Return the model without kept unknowns that have no mass, and the names of these.

    They follow the others statically. This is exact, because no inertia force acts on them, and no
    joint or damper once they are no longer part of the model. Unknowns that are ``laden`` with
    added mass stay. Raises :class:`MatrixError` if they move freely or have damping.

    Examples
    --------
    A mass on two springs in a row, without mass between them, is on one of half the stiffness:

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models.matrices import ExternalMatrices, Unknown, on_all, without_massless
    >>> K = sp.csr_matrix([[2000.0, -1000.0], [-1000.0, 1000.0]])
    >>> names = Unknown("between", "x"), Unknown("end", "x")
    >>> pair = ExternalMatrices(K, sp.diags([0.0, 1e-3]).tocsr(), None, np.zeros((2, 0)), names)
    >>> model, dropped = without_massless(on_all(pair))
    >>> print(model.stiffness, model.names, dropped)
    [[500.]] ('end x',) ('between x',)
    """
    require_names(model)
    assert model.mass is not None
    assert model.names is not None
    count, names = len(model.kept), model.names
    dropped = _massless(np.diag(model.mass)[:count], names)
    dropped &= ~np.isin(names, list(laden))
    if not dropped.any():
        return model, ()
    removed = np.pad(dropped, (0, len(model.mass) - count))
    if removed.all():
        raise MatrixError("no mass at all; allowed: masses, or masses added to points", "mass")
    removed_names = tuple(name for name, is_gone in zip(names, dropped, strict=True) if is_gone)
    followed = _following(model, removed, removed_names)
    kept = ~removed
    square = np.ix_(kept, kept)
    damping = None if model.damping is None else model.damping[square]
    return (
        replace(
            model,
            kept=model.kept[~dropped],
            stiffness=model.stiffness[square] + model.stiffness[np.ix_(kept, removed)] @ followed,
            mass=model.mass[square],
            loads=model.loads[kept] + followed.T @ model.loads[removed],
            names=tuple(name for name in names if name not in removed_names),
            places=None if model.places is None else model.places[~dropped],
            damping=damping,
        ),
        removed_names,
    )


def _massless(masses: Array, names: Sequence[str]) -> np.ndarray:
    """Return flags of the unknowns ``(c,)`` whose mass is zero relative to their kind."""
    turning = np.array([name.rpartition(" ")[2] in ROTATIONS for name in names], dtype=bool)
    massless = np.zeros(len(masses), dtype=bool)
    for kind in (turning, ~turning):
        if kind.any():
            sizes = np.abs(masses[kind])
            massless[kind] = sizes <= MASSLESS * sizes.max()
    return massless


def _following(model: ReducedModel, removed: np.ndarray, names: tuple[str, ...]) -> Array:
    """Return how unknowns without mass follow the others ``(a, b)``: -K_aa⁻¹ K_ab."""
    listed = listed_names(names)
    if model.damping is not None and model.damping[removed].any():
        raise MatrixError(
            f"no mass but damping at {listed}; allowed: masses added there, or no damping",
            "mass",
        )
    K = model.stiffness[removed]
    # Unknowns without stiffness and load have no effect and are left out.
    loose = ~K.any(axis=1) & ~model.loads[removed].any(axis=1)
    followed = np.zeros((len(K), int((~removed).sum())))
    bound = np.flatnonzero(~loose)
    try:
        factors = sl.cho_factor(K[bound][:, np.flatnonzero(removed)[bound]])
    except np.linalg.LinAlgError:
        raise MatrixError(
            f"no mass at {listed}, and nothing that holds them; allowed: masses added there",
            "mass",
        ) from None
    followed[bound] = -sl.cho_solve(factors, K[bound][:, ~removed])
    return followed


def with_light_motions(
    model: ReducedModel, frequency: float
) -> tuple[ReducedModel, tuple[str, ...]]:
    """Return the model with mass in every motion, and the unknowns that move most in added ones.

    Motions without mass are the null space N of the mass scaled to 1 on its diagonal. The mass N Nᵀ
    K N Nᵀ / ω² is added to them alone. With it they vibrate at ``frequency`` [Hz] where the others
    are held. The static response is unchanged; at a frequency f the flexibility of these motions is
    (f / ``frequency``)² too large. Raises :class:`MatrixError` if one of them has no stiffness.

    Examples
    --------
    A mass of 1 kg is moved by two points together, each on a spring; their relative motion has no
    mass:

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models.matrices import ExternalMatrices, Unknown, on_all, with_light_motions
    >>> K = sp.csr_matrix([[2000.0, -1000.0], [-1000.0, 2000.0]])
    >>> M = sp.csr_matrix([[0.25e-3, 0.25e-3], [0.25e-3, 0.25e-3]])
    >>> names = Unknown("a", "x"), Unknown("b", "x")
    >>> own = ExternalMatrices(K, M, None, np.zeros((2, 0)), names)
    >>> model, light = with_light_motions(on_all(own), frequency=1e4)
    >>> print(light, np.linalg.eigvalsh(model.mass).round(9))
    ('a x',) [7.6e-07 5.0e-04]
    """
    require_names(model)
    assert model.mass is not None
    checks.number("frequency", frequency, above=0.0, error=MatrixError)
    diagonal = np.diag(model.mass)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, np.inf))
    # Unknowns without any mass are in the null space alone, and are scaled by their stiffness.
    bare = diagonal <= 0.0
    scale[bare] = 1.0 / np.sqrt(np.abs(np.diag(model.stiffness)[bare]))
    values, shapes = sl.eigh(scale[:, None] * model.mass * scale)
    light = shapes[:, np.abs(values) <= SINGULAR]
    if not light.shape[1]:
        return model, ()
    names = _all_names(model)
    motions = scale[:, None] * light
    held = motions.T @ model.stiffness @ motions
    if sl.eigvalsh(held)[0] <= 0.0:
        raise MatrixError(
            f"no mass and no stiffness in a motion mostly of {names[_most(light[:, 0])]}; "
            "allowed: masses added there",
            "mass",
        )
    within = light / scale[:, None]
    added = within @ (held / (2.0 * np.pi * frequency) ** 2) @ within.T
    most = dict.fromkeys(names[_most(shape)] for shape in light.T)
    return replace(model, mass=model.mass + 0.5 * (added + added.T)), tuple(most)


def _most(shape: Array) -> int:
    """Return the first of the unknowns that move most, up to rounding."""
    sizes = np.abs(shape)
    return int(np.argmax(sizes > (1.0 - 1e-6) * sizes.max()))


def check_definite(model: ReducedModel, laden: Mapping[str, float] = NOTHING) -> int:
    """Return the number of rigid motions of a model, and raise if it is no valid structure.

    The stiffness must have no negative eigenvalue, and the mass only positive ones, with ``laden``
    masses [t] added to displacements by name. Raises :class:`MatrixError` otherwise.

    Examples
    --------
    Two masses that are joined by a spring move as one:

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models.matrices import ExternalMatrices, Unknown, check_definite, on_all
    >>> K = 1e3 * sp.csr_matrix([[1.0, -1.0], [-1.0, 1.0]])
    >>> names = Unknown("a", "x"), Unknown("b", "x")
    >>> check_definite(on_all(ExternalMatrices(K, sp.identity(2), None, np.zeros((2, 0)), names)))
    1
    """
    require_names(model)
    assert model.mass is not None
    for name, value in laden.items():
        checks.number(f"mass added to {name}", value, error=MatrixError)
    names = _all_names(model)
    added = np.diag([laden.get(name, 0.0) for name in names])
    lowest, values = _lowest(model.mass + added, names, "mass")
    if values[0] <= SINGULAR:
        raise MatrixError(
            f"not positive definite: the motion mostly of {lowest} has "
            f"{'no' if values[0] > -SINGULAR else 'a negative'} mass; allowed: masses added there, "
            "structure.massless, or full matrices with retained points and modes",
            "mass",
        )
    lowest, values = _lowest(model.stiffness, names, "stiffness")
    if values[0] < -NEGATIVE:
        raise MatrixError(
            f"an eigenvalue below zero, {values[0]:.2g} of its diagonal, in a motion mostly of "
            f"{lowest}; allowed: a structure that is stable, its rigid motions apart",
            "stiffness",
        )
    return int((values < NEGATIVE).sum())


def lowest_frequencies(matrices: ExternalMatrices, count: int) -> Array:
    """Return the lowest natural frequencies [Hz]: 0 for rigid motions, and up to ``count`` above.

    Raises :class:`MatrixError` for motions without mass or stiffness, and
    :class:`~fe_models.solvers.linear_solver.SolverError` if large matrices have no such
    frequencies.

    Examples
    --------
    Two masses of 1 kg that are joined by a spring of 1 N/µm: 0 and √(2 k/m)

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models.matrices import ExternalMatrices, Unknown, lowest_frequencies
    >>> K = 1e3 * sp.csr_matrix([[1.0, -1.0], [-1.0, 1.0]])
    >>> names = Unknown("a", "x"), Unknown("b", "x")
    >>> pair = ExternalMatrices(K, 1e-3 * sp.identity(2).tocsr(), None, np.zeros((2, 0)), names)
    >>> print((2.0 * np.pi * lowest_frequencies(pair, 3)).round(2))
    [   0.   1414.21]
    """
    if checks.whole("count", count, MatrixError) < 1:
        raise MatrixError(f"{count} frequencies; allowed: 1 or more")
    if len(matrices.unknowns) <= DENSE:
        model, _ = without_massless(on_all(matrices))
        check_definite(model)
        assert model.mass is not None
        K, M = model.stiffness, model.mass
        found = free_frequencies(K, M, min(count + MOST_RIGID, len(K)))
    else:
        K, M = matrices.stiffness, matrices.mass
        found = free_frequencies(K, M, count + MOST_RIGID)
    moved = M.diagonal() > 0.0
    local = float(np.median(K.diagonal()[moved] / M.diagonal()[moved]))
    small = (2.0 * np.pi * found[:-1]) ** 2 < ROUNDING * local
    gaps = np.flatnonzero((small & (found[:-1] < RIGID * found[1:]))[:MOST_RIGID])
    rigid = int(gaps[-1]) + 1 if len(gaps) else 0
    found[:rigid] = 0.0
    return np.asarray(found[: rigid + count])


def _lowest(matrix: Array, names: Sequence[str], part: str) -> tuple[str, Array]:
    """Return the unknown that moves most in the lowest eigenvector, and the eigenvalues.

    The matrix is scaled to 1 on its diagonal, so that units have no influence.
    """
    diagonal = np.diag(matrix)
    wrong = np.flatnonzero((diagonal < 0.0) | ((diagonal == 0.0) & matrix.any(axis=1)))
    if len(wrong):
        k = int(wrong[0])
        raise MatrixError(
            f"{names[k]}: {diagonal[k]:.6g} on the diagonal; allowed: above zero", part
        )
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    values, shapes = sl.eigh(scale[:, None] * matrix * scale)
    return names[_most(shapes[:, 0])], values


def _all_names(model: ReducedModel) -> list[str]:
    modes = range(1, len(model.stiffness) - len(model.kept) + 1)
    return [*(model.names or ()), *(Unknown(f"mode {mode}", MODAL).name for mode in modes)]
