"""A rigid cylinder on an elastic layer, by its compliance in closed form: plane strain.

A layer of thickness h that slides without friction on a rigid base answers a pressure cos kx with
the displacement of a half-plane times F(kh), F(α) = (cosh 2α - 1) / (sinh 2α + 2α) (Johnson 1985,
Contact Mechanics, section 5.8). Pressure is piecewise linear between nodes or constant on strips;
its transform is known, that of the displacement is integrated numerically.
"""

import numpy as np

from sa_solver.types import Array

# Wave numbers, in 1/mm: the integrand falls with the third power.
LONGEST, SHORTEST, WAVES = 1e-3, 4e3, 20_000


def layer_compliance(x: Array, spacing: float, modulus: float, depth: float, hats: bool) -> Array:
    """Displacement at ``x`` ``(n,)`` [mm] under 1 MPa at each of them ``(n, n)`` [mm/MPa].

    Pressure there is a hat over two spacings, or a strip one wide; ``modulus`` is E* [MPa].
    """
    edges = np.geomspace(LONGEST, SHORTEST, WAVES + 1)
    k, dk = np.sqrt(edges[1:] * edges[:-1]), np.diff(edges)
    alpha = np.minimum(k * depth, 300.0)
    softer = (np.cosh(2.0 * alpha) - 1.0) / (np.sinh(2.0 * alpha) + 2.0 * alpha)
    shape = spacing * np.sinc(0.5 * k * spacing / np.pi) ** (2 if hats else 1)
    weights = 2.0 * softer / (modulus * k) * shape * dk / np.pi
    distances = spacing * np.arange(len(x))
    kernel = np.array([weights @ np.cos(k * distance) for distance in distances])
    return kernel[np.abs(np.subtract.outer(range(len(x)), range(len(x))))]


def press(compliance: Array, gap: Array, widths: Array, load: float) -> Array:
    """Pressure ``(n,)`` [MPa] of a rigid body that is pressed on with ``load`` [N/mm]."""
    pressed = np.ones(len(gap), dtype=bool)
    while True:
        count = int(pressed.sum())
        matrix = np.zeros((count + 1, count + 1))
        matrix[:-1, :-1] = compliance[np.ix_(pressed, pressed)]
        matrix[:-1, -1], matrix[-1, :-1] = -1.0, widths[pressed]
        solved = np.linalg.solve(matrix, np.append(-gap[pressed], load))
        if (solved[:-1] >= 0.0).all():
            pressure = np.zeros(len(gap))
            pressure[pressed] = solved[:-1]
            return pressure
        pressed[np.flatnonzero(pressed)[solved[:-1] < 0.0]] = False
