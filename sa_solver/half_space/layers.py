"""Response of layered bodies to waves of traction on their surface.

A wave of traction with the wave number k along s moves the surface of a half-space z >= 0 by

    u_s = [A t_s - i C t_z]/k        u_t = T t_t/k        u_z = [i C t_s + N t_z]/k

with t across the wave. A body of one material has N = A = (1-ν)/G, T = 1/G and C = (1-2ν)/2G.
Layers make these functions of k: waves much shorter than the thickness feel the outermost layer,
much longer ones the body below all layers.

Within a layer, with a = -i u_s, w = u_z, τ = -i σ_sz/k and σ = σ_zz/k, the equations of elasticity
are d(a, w, τ, σ)/d(kz) = M (a, w, τ, σ), and those of the motion across the wave have the solutions
cosh kz and sinh kz. The compliances are carried upwards from the lowest interface in steps of
kz <= 2, which keeps rounding errors small for thin and for thick layers (method of the compliance,
or impedance, matrix).

Source: Kausel & Roësset 1981, Bull. Seismol. Soc. Am. 71, 1743 (matrices of layers, here without
inertia).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sa_solver.errors import InputError
from sa_solver.types import Array, ElasticPair, Layer, Material

STEPS, LONGEST_STEP = 20, 2.0
"""Steps through a layer, and the longest of them, in kz. Waves that decay by more than e^-40 in a
layer do not feel its lower side."""


@dataclass(frozen=True)
class Compliances:
    """Compliances of a surface over wave numbers, each ``(n,)`` [1/MPa]."""

    normal: Array
    along: Array
    across: Array
    coupling: Array


def pair_compliances(pair: ElasticPair, wave_numbers: Array) -> Compliances:
    """Return those of both bodies together at ``wave_numbers`` ``(n,)`` [1/mm]."""
    first, second = (body_compliances(body, wave_numbers) for body in pair.bodies)
    return Compliances(
        normal=first.normal + second.normal,
        along=first.along + second.along,
        across=first.across + second.across,
        # Body 1 lies on the other side of the surface.
        coupling=second.coupling - first.coupling,
    )


def body_compliances(body: Material, wave_numbers: Array) -> Compliances:
    """Return those of one ``body``, in z >= 0, at ``wave_numbers`` ``(n,)`` [1/mm]."""
    found = _homogeneous(body, np.ones_like(wave_numbers))
    for layer in reversed(body.layers):
        found = _through(layer, found, wave_numbers).compliances
    return found


@dataclass(frozen=True)
class WaveStress:
    """Stress at a depth under unit waves of traction on the surface, over wave numbers.

    Stress has the components along the wave, across it and along z. A component that is 90° ahead
    of its traction is given over the imaginary unit.

    ``pressed`` and ``sheared`` ``(4, n)`` are σ_ss, σ_tt, σ_zz and σ_sz under tz and under ts: the
    last is ahead under tz, the others are under ts. ``across`` ``(2, n)`` are σ_tz and σ_st under
    tt, of which the latter is ahead.
    """

    pressed: Array
    sheared: Array
    across: Array


def wave_stress(body: Material, depth: float, wave_numbers: Array) -> WaveStress:
    """Return the stress at a ``depth`` [mm] of a ``body`` in z >= 0.

    On an interface it is the stress above it. Raises InputError for a depth below the layers of a
    rigid body.
    """
    above, material, below = split(body, depth)
    at_depth = found = body_compliances(below, wave_numbers)
    plane = np.broadcast_to(np.eye(2), (len(wave_numbers), 2, 2))
    across = np.ones_like(wave_numbers)
    for layer in reversed(above):
        passed = _through(layer, found, wave_numbers)
        found = passed.compliances
        plane, across = plane @ passed.plane, across * passed.across
    # Stresses τ and σ at the depth, and the motion a, for τ and σ of 1 at the surface.
    tau, sigma = plane[:, 0].T, plane[:, 1].T
    motion = (_in_plane(at_depth) @ plane)[:, 0].T
    nu, shear_modulus = material.poisson, material.shear_modulus
    along = (nu * sigma - 2.0 * shear_modulus * motion) / (1.0 - nu)
    # The traction on the surface is -i τ, -σ.
    by_tau, by_sigma = np.array([along, nu * (along + sigma), sigma, -tau]).swapaxes(0, 1)
    return WaveStress(
        pressed=np.stack([*-by_sigma[:3], by_sigma[3]]),
        sheared=by_tau,
        across=np.stack([-across, shear_modulus * at_depth.across * across]),
    )


def split(body: Material, depth: float) -> tuple[list[Layer], Material, Material]:
    """Return the layers above a ``depth`` [mm], the material there and the body below it.

    A depth on an interface belongs to the layer above it. Raises InputError for a depth in a rigid
    body.
    """
    above: list[Layer] = []
    for number, layer in enumerate(body.layers):
        if depth <= layer.thickness:
            here = Material(layer.young, layer.poisson)
            parts = [replace(layer, thickness=depth)] if depth > 0.0 else []
            rest = layer.thickness - depth
            under = [replace(layer, thickness=rest)] if rest > 0.0 else []
            below = replace(body, layers=(*under, *body.layers[number + 1 :]))
            return above + parts, here, below
        above.append(layer)
        depth -= layer.thickness
    if np.isinf(body.young):
        raise InputError(
            "the body below the layers is rigid, and its stress unknown: give a depth within them"
        )
    below = replace(body, layers=())
    return [*above, Layer(depth, body.young, body.poisson)] if depth > 0.0 else above, body, below


def _homogeneous(body: Material, one: Array) -> Compliances:
    """Return those of a ``body`` without its layers."""
    softness = 1.0 / body.shear_modulus
    normal = (1.0 - body.poisson) * softness * one
    return Compliances(normal, normal, softness * one, (0.5 - body.poisson) * softness * one)


@dataclass(frozen=True)
class _Passed:
    """Compliances above a layer, and the stress below it for unit stress above it.

    ``plane`` ``(n, 2, 2)`` holds for τ and σ, ``across`` ``(n,)`` for σ_tz.
    """

    compliances: Compliances
    plane: Array
    across: Array


def _through(layer: Layer, below: Compliances, wave_numbers: Array) -> _Passed:
    """Return what is above a ``layer`` from the compliances ``below`` it."""
    step = np.minimum(wave_numbers * layer.thickness / STEPS, LONGEST_STEP)
    shear_modulus = 0.5 * layer.young / (1.0 + layer.poisson)
    upwards = _propagator(layer.poisson, shear_modulus, -step)
    plane, across = _in_plane(below), below.across
    passed, passed_across = np.eye(2), np.ones_like(step)
    cosh, sinh = np.cosh(step), np.sinh(step)
    for _ in range(STEPS):
        motion = upwards[:, :2, :2] @ plane + upwards[:, :2, 2:]
        back = _inverse(upwards[:, 2:, :2] @ plane + upwards[:, 2:, 2:])
        plane, passed = motion @ back, passed @ back
        stress = cosh + shear_modulus * sinh * across
        across = (across * cosh + sinh / shear_modulus) / stress
        passed_across = passed_across / stress
    compliances = Compliances(-plane[:, 1, 1], -plane[:, 0, 0], across, -plane[:, 0, 1])
    return _Passed(compliances, passed, passed_across)


def _in_plane(compliances: Compliances) -> Array:
    """Return the matrices ``(n, 2, 2)`` of (a, w) under (τ, σ) on top of a body.

    The traction on the body is that of the stress above it, with the opposite sign.
    """
    rows = [
        [compliances.along, compliances.coupling],
        [compliances.coupling, compliances.normal],
    ]
    return -np.moveaxis(np.array(rows), 2, 0)


def _inverse(matrices: Array) -> Array:
    """Return the inverses of ``matrices`` ``(n, 2, 2)``, faster than one after the other."""
    (a, b), (c, d) = np.moveaxis(matrices, 0, 2)
    adjugates = np.moveaxis(np.array([[d, -b], [-c, a]]), 2, 0)
    return np.asarray(adjugates / (a * d - b * c)[:, None, None])


def _propagator(poisson: float, shear_modulus: float, distance: Array) -> Array:
    """Return exp(M kz) ``(n, 4, 4)`` for ``distance`` kz ``(n,)``.

    As (M² - 1)² = 0, it is a polynomial of the third degree in M.
    """
    ratio = poisson / (1.0 - poisson)
    system = np.zeros((4, 4))
    system[0, 1], system[0, 2] = -1.0, 1.0 / shear_modulus
    system[1, 0], system[1, 3] = ratio, 0.5 * (1.0 - ratio) / shear_modulus
    system[2, 0], system[2, 3] = 2.0 * shear_modulus / (1.0 - poisson), -ratio
    system[3, 2] = 1.0
    cosh, sinh = np.cosh(distance), np.sinh(distance)
    second, third = 0.5 * distance * sinh, 0.5 * (distance * cosh - sinh)
    weights = np.array([cosh - second, sinh - third, second, third])
    powers = np.array([np.linalg.matrix_power(system, n) for n in range(4)])
    return np.asarray(np.einsum("pn,pij->nij", weights, powers))
