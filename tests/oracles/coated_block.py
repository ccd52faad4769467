"""Rigid sphere on a coated block, axisymmetric, by finite elements.

The elements are quadratic, and graded away from the contact. On the far borders the displacement is
Boussinesq's (Johnson 1985, eq. 3.18) for the body below the coating. Pressure is piecewise linear
over the radius; gap and pressure are in equilibrium in the mean with the same functions.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad
from skfem.helpers import ddot, sym_grad

from sa_solver.types import Array, Material

ELEMENT = ElementVector(ElementQuad2())
RINGS, REACH = 45, 1.5
FAR, GROWTH = 80.0, 1.35


def sphere_on_coating(
    body: Material, radius: float, load: float, scale: float
) -> tuple[float, Array, Array]:
    """Return approach [mm], radii ``(n,)`` [mm] and pressures ``(n,)`` [MPa] of the contact.

    The ``body`` has one layer; the contact is narrower than 1.5 times ``scale`` [mm].
    """
    (layer,) = body.layers
    r = _graded(REACH * scale, RINGS, FAR * scale)
    inside = np.linspace(0.0, layer.thickness, 13)
    z = np.concatenate([inside, layer.thickness + _graded(scale, 10, FAR * scale)[1:]])
    mesh = MeshQuad.init_tensor(r, z)
    basis = Basis(mesh, ELEMENT, intorder=5)
    top = mesh.facets_satisfying(lambda x: x[1] == 0.0, boundaries_only=True)
    surface, rings = FacetBasis(mesh, ELEMENT, facets=top, intorder=5), r[: RINGS + 1]
    hats = [partial(np.interp, xp=rings, fp=one, right=0.0) for one in np.eye(RINGS + 1)[:-1]]
    # Nodal forces of each hat, its whole force, and the mean gap of the sphere under it.
    forces = np.array([_ring_force(hat).assemble(surface) for hat in hats])
    fine = np.linspace(0.0, rings[-1], 40 * RINGS + 1)
    shares = np.array([2.0 * np.pi * fine * hat(fine) for hat in hats])
    weights = np.trapezoid(shares, fine)
    gap = np.trapezoid(shares * fine**2, fine) / (2.0 * radius)
    moved = _moved(_stiffness(basis, body), basis, body, forces, weights)
    compliance = moved @ forces.T
    return _pressed(0.5 * (compliance + compliance.T), gap, weights, load, rings[:-1])


def _graded(inner: float, count: int, outer: float) -> Array:
    """Return ``count`` equal intervals up to ``inner``, then growing ones up to ``outer``."""
    ends = np.linspace(0.0, inner, count + 1).tolist()
    length = inner / count
    while ends[-1] < outer:
        length *= GROWTH
        ends.append(ends[-1] + length)
    return np.array(ends)


def _ring_force(hat: Callable[[Array], Array]) -> LinearForm:
    return LinearForm(lambda v, w: 2.0 * np.pi * w.x[0] * hat(w.x[0]) * v[1])


def _stiffness(basis: Basis, body: Material) -> csr_matrix:
    (layer,) = body.layers
    mesh = basis.mesh
    coating = mesh.p[1, mesh.t].mean(axis=0) < layer.thickness
    young = np.where(coating, layer.young, body.young)[:, None]
    nu = np.where(coating, layer.poisson, body.poisson)[:, None]
    lame, shear = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * young / (1.0 + nu)

    @BilinearForm
    def energy(u, v, w):
        e, f = sym_grad(u), sym_grad(v)
        hoop, other = u[0] / w.x[0], v[0] / w.x[0]
        dilatation = (e[0, 0] + e[1, 1] + hoop) * (f[0, 0] + f[1, 1] + other)
        strained = lame * dilatation + 2.0 * shear * (ddot(e, f) + hoop * other)
        return 2.0 * np.pi * w.x[0] * strained

    return energy.assemble(basis)


def _moved(
    stiffness: csr_matrix, basis: Basis, body: Material, forces: Array, weights: Array
) -> Array:
    """Return the displacements under ``forces``, with Boussinesq's on the far borders."""
    x, y = basis.doflocs
    far = np.flatnonzero(np.isclose(x, x.max()) | np.isclose(y, y.max()))
    axis = basis.get_dofs(lambda x: x[0] == 0.0).all("u^1")
    fixed = np.union1d(axis, far)
    free = np.setdiff1d(np.arange(basis.N), fixed)
    rho, k = np.hypot(x, y)[far], 1.0 - 2.0 * body.poisson
    radial = x[far] * y[far] / rho**3 - k * x[far] / (rho * (rho + y[far]))
    down = y[far] ** 2 / rho**3 + 2.0 * (1.0 - body.poisson) / rho
    lifted = np.zeros(basis.N)
    is_radial = np.isin(far, basis.get_dofs(elements=True).all("u^1"))
    lifted[far] = np.where(is_radial, radial, down) / (4.0 * np.pi * body.shear_modulus)
    lifted[axis] = 0.0
    moved = np.outer(weights, lifted)
    right = forces[:, free] - moved[:, fixed] @ stiffness[fixed][:, free]
    moved[:, free] = splu(stiffness[free][:, free].tocsc()).solve(right.T).T
    return moved


def _pressed(
    compliance: Array, gap: Array, weights: Array, load: float, rings: Array
) -> tuple[float, Array, Array]:
    """Return the solution where pressures are not negative."""
    touching = np.ones(len(gap), dtype=bool)
    while True:
        count = int(touching.sum())
        matrix = np.zeros((count + 1, count + 1))
        matrix[:-1, :-1] = compliance[np.ix_(touching, touching)]
        matrix[:-1, -1], matrix[-1, :-1] = -weights[touching], weights[touching]
        solved = np.linalg.solve(matrix, np.append(-gap[touching], load))
        if (solved[:-1] >= 0.0).all():
            pressure = np.zeros(len(gap))
            pressure[touching] = solved[:-1]
            return float(solved[-1]), rings, pressure
        touching[np.flatnonzero(touching)[solved[:-1] < 0.0]] = False
