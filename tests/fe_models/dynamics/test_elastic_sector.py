"""Finite-element sector of a wheel, cut through solid material, against the whole wheel."""

import numpy as np
import scipy.linalg as sl
from skfem import MeshTet

from fe_models.dynamics.rig import natural_frequencies
from fe_models.dynamics.rings.sector import Ring, reduced_sector
from fe_models.elasticity.body import ElasticBody
from fe_models.joints.reduction import reduce_body
from fe_models.meshes.structure_mesh import Body
from sa_solver.types import Material

STEEL = Material(young=210e3, poisson=0.3, density=7.8e-9)
SECTORS, CELLS = 5, 3


def wheel(cells):
    """Return the body of part of a wheel, and angle and (r, z) of its nodes.

    ``cells`` is the number of cells around.
    """
    angles = np.arange(cells + 1) * (2.0 * np.pi / (SECTORS * CELLS))
    flat = MeshTet.init_tensor(np.array([40.0, 60.0, 90.0]), angles, np.array([0.0, 8.0]))
    radius, angle, height = flat.p
    # A whole wheel closes on itself.
    meets = np.isclose(angle, 2.0 * np.pi)
    first = {(r, z): node for node, (r, a, z) in enumerate(flat.p.T) if a == 0.0}
    to = np.arange(len(angle))
    to[meets] = [first[r, z] for r, _, z in flat.p.T[meets]]
    kept, nodes = np.unique(to, return_inverse=True)
    places = np.stack([radius * np.cos(angle), radius * np.sin(angle), height])[:, kept]
    mesh = MeshTet(np.ascontiguousarray(places), np.ascontiguousarray(nodes[flat.t]))
    return ElasticBody(Body("wheel", mesh), STEEL), angle[kept], flat.p[[0, 2]].T[kept]


def test_a_sector_of_finite_elements_has_the_frequencies_of_its_wheel():
    """The sector is reduced by Craig and Bampton and rotated about z, with fixed axes."""
    body, angle, across = wheel(CELLS)
    faces = [
        sorted(np.flatnonzero(angle == end), key=lambda node: tuple(across[node]))
        for end in (0.0, angle.max())
    ]
    kept = (3 * np.concatenate(faces)[:, None] + np.arange(3)).ravel()
    count = len(faces[0])
    left, right = (
        [f"{face} {node} {axis}" for node in range(count) for axis in "xyz"]
        for face in ("left", "right")
    )
    ring = Ring(SECTORS, 1, dict(zip(right, left, strict=True)), axis="z")
    whole, _, _ = wheel(SECTORS * CELLS)
    squares = sl.eigvalsh(whole.stiffness.toarray(), whole.mass.toarray())
    lowest = slice(6, 40)
    every = np.sqrt(squares[lowest]) / (2.0 * np.pi)
    # All fixed-interface modes but one, and a third of them: neglected modes make the sector
    # stiffer.
    for modes, error in ((body.size - len(kept) - 1, 1e-5), (12, 1e-2)):
        reduced = reduce_body(body.stiffness, body.mass, kept, modes=modes)
        sector = reduced_sector(reduced, (*left, *right), [], ring)
        by_shift = [natural_frequencies(sector.at(shift)) for shift in range(SECTORS)]
        # Rigid motions: along and about the axis, and across it two waves of one nodal diameter.
        assert [np.count_nonzero(found == 0.0) for found in by_shift] == [2, 2, 0, 0, 2]
        stiffer = np.sort(np.concatenate(by_shift))[lowest] / every - 1.0
        assert stiffer.min() > -1e-9
        assert stiffer.max() < error
