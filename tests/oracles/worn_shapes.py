"""Cylinder and sphere that have slid for long: see ``tests/wear/test_closed_forms.py``."""

import numpy as np


def worn_cylinder(
    load: float, volume: float, radius: float, modulus: float
) -> tuple[float, float, float]:
    """Return b [mm], W(0) [mm] and p(0) [MPa] of a cylinder worn by ``volume`` [mm²]."""
    a = np.sqrt(4.0 * load * radius / (np.pi * modulus))
    (b,) = (
        root.real
        for root in np.roots([2.0 / 3.0, 0.0, -0.5 * a**2, -volume * radius])
        if abs(root.imag) < 1e-12 and root.real > a
    )
    ratio = (a / b) ** 2
    depth = 0.5 * b**2 / radius * (1.0 - ratio * np.log(2.0))
    return b, depth, load / (2.0 * b) / (1.0 - 0.25 * ratio)


def worn_sphere(
    load: float, volume: float, radius: float, modulus: float
) -> tuple[float, float, float]:
    """Return b [mm], W(0) [mm] and p(0) [MPa] of a sphere worn by ``volume`` [mm³]."""
    a3 = 0.75 * load * radius / modulus
    (b,) = (
        root.real
        for root in np.roots([0.25 * np.pi, 0.0, 0.0, -16.0 * a3 / (9.0 * np.pi), -volume * radius])
        if abs(root.imag) < 1e-12 and root.real**3 > a3
    )
    ratio, share = a3 / b**3, (1.0 - 2.0 / np.pi) / np.pi
    depth = 0.5 * b**2 / radius * (1.0 - 16.0 / 3.0 * share * ratio)
    rise = (1.0 + 8.0 / 3.0 * share * ratio) / (1.0 - 16.0 / (9.0 * np.pi**2) * ratio)
    return b, depth, load / (np.pi * b**2) * rise
