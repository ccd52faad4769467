"""Layered half-space under a wave of traction, by finite elements over the depth.

With u_s = -a sin ks, u_z = w cos ks and u_t = v cos ks the elastic energy of a wavelength is an
integral over the depth. The displacements a, w, v are quadratic on graded elements, which end where
waves have decayed. This uses neither transfer matrices nor the equations of equilibrium.
"""

from itertools import pairwise

import numpy as np
from skfem import Basis, BilinearForm, ElementLineP2, ElementVector, MeshLine, condense, solve

from sa_solver.types import Array, Material

ELEMENTS = 400
DECAYED = 25.0


def column(body: Material, wave_number: float) -> tuple[Basis, Array]:
    """Return the basis of (a, w, v) and their values under unit tractions ts, tz, tt ``(3, n)``."""
    ends = np.cumsum([0.0, *(layer.thickness for layer in body.layers)])
    parts = [np.linspace(*pair, ELEMENTS + 1) for pair in pairwise(ends)]
    rest = DECAYED / wave_number * np.linspace(0.0, 1.0, 4 * ELEMENTS + 1) ** 2
    rigid = np.isinf(body.young)
    z = np.unique(np.concatenate([*parts, [] if rigid else ends[-1] + rest]))
    mesh = MeshLine(z)
    basis = Basis(mesh, ElementVector(ElementLineP2(), 3), intorder=4)
    materials = [*body.layers, *([] if rigid else [body])]
    centres = mesh.p[0, mesh.t].mean(axis=0)
    number = np.minimum(np.searchsorted(ends, centres) - 1, len(materials) - 1)
    young, nu = (np.array([getattr(m, n) for m in materials])[number] for n in ("young", "poisson"))
    shear = (0.5 * young / (1.0 + nu))[:, None]
    lame = (young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)))[:, None]
    k = wave_number

    @BilinearForm
    def energy(u, test, _):
        (a, w, v), (b, y, q) = u, test
        (da, dw, dv), (db, dy, dq) = u.grad[:, 0], test.grad[:, 0]
        dilatation, other = dw - k * a, dy - k * b
        stretched = 2.0 * (k * k * a * b + dw * dy) + (da + k * w) * (db + k * y)
        return lame * dilatation * other + shear * (stretched + k * k * v * q + dv * dq)

    stiffness = energy.assemble(basis)
    top, bottom = (basis.get_dofs(lambda x, at=at: np.isclose(x[0], at)) for at in (z[0], z[-1]))
    moved = []
    for field in ("u^1", "u^2", "u^3"):
        load = np.zeros(basis.N)
        load[top.all(field)] = 1.0
        moved.append(solve(*condense(stiffness, load, D=bottom.all())))
    return basis, np.array(moved)


def column_compliances(body: Material, wave_number: float) -> Array:
    """Return N, A, T and C of a ``body`` [1/MPa]."""
    basis, (sheared, pressed, across) = column(body, wave_number)
    top = basis.get_dofs(lambda x: np.isclose(x[0], 0.0))
    a, w, v = (top.all(field)[0] for field in ("u^1", "u^2", "u^3"))
    return wave_number * np.array([pressed[w], sheared[a], across[v], sheared[w]])
