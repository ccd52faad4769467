"""The friction rig as two masses in a row."""

from __future__ import annotations

from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.rig import Link, lumped_rig


def two_mass_rig(
    masses: tuple[float, float], springs: tuple[float, float], damping_ratio: float = 0.0
) -> DynamicModel:
    """Return the friction rig: ground - k1 - m1 - k2 - m2 - joint - ground.

    ``masses`` [t], ``springs`` [N/mm], ``damping_ratio`` of both modes with the joint free.
    Its points are ``m1`` and ``m2`` (Fantetti et al. 2019, Tribology International 138, 111).
    """
    return lumped_rig(
        dict(zip(("m1", "m2"), masses, strict=True)),
        {Link("m1"): springs[0], Link("m2", "m1"): springs[1]},
        [[Link("m2")]],
        damping_ratio,
    )
