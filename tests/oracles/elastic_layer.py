"""A rigid cylinder on an elastic layer, by its compliance in closed form: plane strain.

A layer of thickness h on a rigid base answers a pressure cos kx with the displacement of a
half-plane times F(α), α = kh. Where it slides on the base without friction, as the middle of a
strip of twice the thickness between two cylinders does, F = (cosh 2α - 1) / (sinh 2α + 2α); where
it sticks to it, with κ = 3 - 4ν, F = (2κ sinh 2α - 4α) / (2κ cosh 2α + 4α² + κ² + 1) (Meijers 1968,
doi:10.1007/BF00411551; Johnson 1985, Contact Mechanics, section 5.8). Pressure is piecewise linear
between nodes or constant on strips; its transform is known, that of the displacement is integrated
numerically. ``test_elastic_layer.py`` holds it against the equations of elasticity.
"""

import numpy as np

from sa_solver.types import Array

# Wave numbers, in 1/mm: the integrand falls with the third power.
LONGEST, SHORTEST, WAVES = 1e-3, 4e3, 20_000


def softness(alpha: Array, stuck: float | None = None) -> Array:
    """Return F at wave numbers over the thickness; ``stuck`` is ν of a layer that sticks."""
    alpha = np.minimum(alpha, 300.0)
    sinh, cosh = np.sinh(2.0 * alpha), np.cosh(2.0 * alpha)
    if stuck is None:
        return (cosh - 1.0) / (sinh + 2.0 * alpha)
    kappa = 3.0 - 4.0 * stuck
    return (2.0 * kappa * sinh - 4.0 * alpha) / (
        2.0 * kappa * cosh + 4.0 * alpha**2 + kappa**2 + 1.0
    )


def layer_compliance(
    x: Array, spacing: float, modulus: float, depth: float, hats: bool, stuck: float | None = None
) -> Array:
    """Return the displacement at ``x`` ``(n,)`` [mm] under 1 MPa at each ``(n, n)`` [mm/MPa].

    The pressure is a hat over two spacings, or a strip one wide; ``modulus`` is E* [MPa], and
    ``stuck`` as for :func:`softness`.
    """
    edges = np.geomspace(LONGEST, SHORTEST, WAVES + 1)
    k, dk = np.sqrt(edges[1:] * edges[:-1]), np.diff(edges)
    shape = spacing * np.sinc(0.5 * k * spacing / np.pi) ** (2 if hats else 1)
    weights = 2.0 * softness(k * depth, stuck) / (modulus * k) * shape * dk / np.pi
    distances = spacing * np.arange(len(x))
    kernel = np.array([weights @ np.cos(k * distance) for distance in distances])
    return kernel[np.abs(np.subtract.outer(range(len(x)), range(len(x))))]


def press(compliance: Array, gap: Array, widths: Array, load: float) -> Array:
    """Return the pressure ``(n,)`` [MPa] of a rigid body pressed with ``load`` [N/mm]."""
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
