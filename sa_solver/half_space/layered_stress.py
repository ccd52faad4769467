"""Influence coefficients: stress in a layered body under uniform traction on a rectangle or strip.

The stress at a depth is a sum over waves of traction (:func:`.layers.wave_stress`). In the outer
layer the part of a body of its material alone is known in closed form
(:mod:`sa_solver.half_space.subsurface_influence`), and what is added is smooth over the thickness
of the layer. Below it the whole stress is smooth over the depth.

With the sums Hn of :mod:`sa_solver.half_space.layered_influence`, the angle φ to x and, for the
stress under a traction, s = σ_ss + σ_tt and d = σ_ss - σ_tt, 2π times the response to a point force
is, at the wave number k,

         under tz                          under tx
    xx   ½ (H0[ks] - cos 2φ H2[kd])       -cos φ H1[k(2s + d + 2w)]/4 + cos 3φ H3[k(d - 2w)]/4
    yy   ½ (H0[ks] + cos 2φ H2[kd])       -cos φ H1[k(2s - d - 2w)]/4 - cos 3φ H3[k(d - 2w)]/4
    zz   H0[kσ_zz]                        -cos φ H1[kσ_zz]
    xy   -½ sin 2φ H2[kd]                 -sin φ H1[k(d + 2w)]/4 + sin 3φ H3[k(d - 2w)]/4
    yz   -sin φ H1[kσ_sz]                 -½ sin 2φ H2[k(σ_sz - v)]
    zx   -cos φ H1[kσ_sz]                 ½ (H0[k(σ_sz + v)] - cos 2φ H2[k(σ_sz - v)])

where v = σ_tz and w = σ_st are those under traction across the wave; under ty, x and y are
exchanged.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sa_solver.half_space.cell_means import CellIntegrals
from sa_solver.half_space.hankel import WaveNumbers
from sa_solver.half_space.layers import LONGEST_STEP, STEPS, WaveStress, wave_stress
from sa_solver.half_space.subsurface_influence import (
    EXCHANGED,
    INDICES,
    XX,
    XY,
    YY,
    YZ,
    ZX,
    ZZ,
    rectangle_stress,
    strip_stress,
)
from sa_solver.types import Array, Material

TX, TY, TZ = range(3)
"""Indices of the tractions."""


def layered_rectangles(edges_x: Array, edges_y: Array, depth: float, body: Material) -> Array:
    """Return the stress ``(6, 3, n, m)`` [1] at a ``depth`` [mm] of a layered ``body``.

    The arguments are those of :func:`.subsurface_influence.rectangle_stress`.
    """
    waves, stress = _waves(body), _added(body, depth)
    axes = [
        [CellIntegrals(edges, body.layers[0].thickness, odd) for odd in (False, True)]
        for edges in (edges_x, edges_y)
    ]
    x, y = axes[0][0].points[:, None], axes[1][0].points[None, :]
    kernels = np.stack(
        [
            _sheared(waves, stress, x, y),
            _sheared(waves, stress, y, x)[EXCHANGED],
            _pressed(waves, stress, x, y),
        ],
        axis=1,
    )
    total = np.empty((6, 3, len(edges_x) - 1, len(edges_y) - 1))
    for i, k in np.ndindex(6, 3):
        odd = [(*INDICES[i], k).count(axis) % 2 for axis in (0, 1)]
        total[i, k] = axes[0][odd[0]].weights @ kernels[i, k] @ axes[1][odd[1]].weights.T
    total /= 2.0 * np.pi
    if depth <= body.layers[0].thickness:
        total += rectangle_stress(edges_x, edges_y, depth, body.layers[0].poisson)
    return total


def layered_strips(edges: Array, depth: float, body: Material) -> Array:
    """Return the stress ``(6, 3, n)`` [1] at a ``depth`` [mm] of a layered ``body``.

    The arguments are those of :func:`.subsurface_influence.strip_stress`.
    """
    waves, stress = _waves(body), _added(body, depth)
    even, odd = (CellIntegrals(edges, body.layers[0].thickness, of_odd) for of_odd in (False, True))

    def mean(function: Array) -> Array:
        return np.asarray(even.weights @ waves.cosines(function)(even.points))

    def gradient(function: Array) -> Array:
        return np.asarray(-(odd.weights @ waves.sines(function)(odd.points)))

    total = np.zeros((6, 3, len(edges) - 1))
    for place, component in enumerate((XX, YY, ZZ)):
        total[component, TZ] = mean(stress.pressed[place])
        total[component, TX] = gradient(stress.sheared[place])
    total[ZX, TZ], total[ZX, TX] = gradient(stress.pressed[3]), mean(stress.sheared[3])
    total[YZ, TY], total[XY, TY] = mean(stress.across[0]), gradient(stress.across[1])
    total /= np.pi
    if depth <= body.layers[0].thickness:
        total += strip_stress(edges, depth, body.layers[0].poisson)
    return total


def _waves(body: Material) -> WaveNumbers:
    thicknesses = [layer.thickness for layer in body.layers]
    return WaveNumbers(thicknesses[0], sum(thicknesses))


def _added(body: Material, depth: float) -> WaveStress:
    """Return the stress in a ``body``, in the outermost layer less that of its material alone."""
    outermost, wave_numbers = body.layers[0], _waves(body).values
    # Shorter waves end above the depth, or do not come back from the interface.
    felt = wave_numbers * outermost.thickness < STEPS * LONGEST_STEP
    found = wave_stress(body, depth, wave_numbers[felt])
    parts = [found.pressed, found.sheared, found.across]
    if depth <= outermost.thickness:
        alone = wave_stress(Material(outermost.young, outermost.poisson), depth, wave_numbers[felt])
        for part, known in zip(parts, (alone.pressed, alone.sheared, alone.across), strict=True):
            part -= known
    whole = [np.zeros((len(part), len(wave_numbers))) for part in parts]
    for zeros, part in zip(whole, parts, strict=True):
        zeros[:, felt] = part
    return WaveStress(*whole)


def _pressed(waves: WaveNumbers, stress: WaveStress, x: Array, y: Array) -> Array:
    """Return 2π times the stress ``(6, ...)`` under a unit point force along z."""
    h = _sums(waves, np.hypot(x, y))
    along, across, normal, shear = stress.pressed
    mean, deviator = 0.5 * h(along + across, 0), 0.5 * h(along - across, 2)
    (c1, s1), (c2, s2), _ = _multiples(x, y)
    lateral = h(shear, 1)
    kernel = np.empty((6, *mean.shape))
    kernel[XX], kernel[YY] = mean - c2 * deviator, mean + c2 * deviator
    kernel[ZZ], kernel[XY] = h(normal, 0), -s2 * deviator
    kernel[YZ], kernel[ZX] = -s1 * lateral, -c1 * lateral
    return kernel


def _sheared(waves: WaveNumbers, stress: WaveStress, x: Array, y: Array) -> Array:
    """Return 2π times the stress ``(6, ...)`` under a unit point force along x."""
    h = _sums(waves, np.hypot(x, y))
    along, across, normal, shear = stress.sheared
    shear_across, in_plane = stress.across
    mean, deviator = 2.0 * (along + across), along - across
    first = 0.25 * h(mean, 1)
    second = 0.25 * h(deviator + 2.0 * in_plane, 1)
    third = 0.25 * h(deviator - 2.0 * in_plane, 3)
    both, other = 0.5 * h(shear + shear_across, 0), 0.5 * h(shear - shear_across, 2)
    (c1, s1), (c2, s2), (c3, s3) = _multiples(x, y)
    kernel = np.empty((6, *first.shape))
    kernel[XX] = -c1 * (first + second) + c3 * third
    kernel[YY] = -c1 * (first - second) - c3 * third
    kernel[ZZ] = -c1 * h(normal, 1)
    kernel[XY] = -s1 * second + s3 * third
    kernel[YZ], kernel[ZX] = -s2 * other, both - c2 * other
    return kernel


def _sums(waves: WaveNumbers, distance: Array) -> Callable[[Array, int], Array]:
    """Return Hn[k f] at a ``distance`` as a function of f ``(n,)`` and the order n."""
    return lambda function, order: waves.transform(waves.values * function, order)(distance)


def _multiples(x: Array, y: Array) -> list[tuple[Array, Array]]:
    """Return cosine and sine of φ, 2φ and 3φ, the angle of (x, y) to x."""
    turned = (x + 1j * y) / np.hypot(x, y)
    return [((turned**n).real, (turned**n).imag) for n in (1, 2, 3)]
