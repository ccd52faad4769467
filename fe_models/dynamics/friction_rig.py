"""Friction rig with two specimens in contact: two reduced bodies and two masses.

    ground - k1 - m1 - k2 - m2 = ring of the upper specimen, pads, ring of the lower one = ground

The holder of the upper specimen is rigid with the mass m2, which moves along x and z and does not
turn. The holder of the lower specimen is the ground. The mass m1 moves along x. Along z, only the
contact and the load on m2 hold the rig. The specimens stand in their interface's frame, the upper
one at z > 0.

Source: "Dynamics simulations of fretting wear for aero-engine applications" (thesis), section 5.2.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.ground_motion import translation_of
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.rig import Link, RigError, connected_rig
from fe_models.joints.reduction import ReducedModel
from fe_models.specimens import PAD, RING
from sa_solver.types import Array

# Displacements of the holder of the upper specimen, by direction.
HOLDER = {"x": "m2 x", "z": "m2 z"}


def friction_rig(
    lower: ReducedModel,
    upper: ReducedModel,
    masses: tuple[float, float],
    springs: tuple[float, float],
    damping_ratio: float | Array = 0.0,
) -> DynamicModel:
    """Return the model of the friction rig, with a joint of three directions at every pad node.

    The displacements are ``m1 x``, ``m2 x``, ``m2 z`` and those of the specimens, such as
    ``lower pad 17 x``. A joint joins two opposite pad nodes. It stretches along x and y as the
    upper pad moves over the lower one, and along z as the upper pad approaches the lower one.

    Parameters
    ----------
    lower, upper
        The reduced specimens, with mass matrices and names.
    masses
        Masses m1 and m2 [t].
    springs
        Stiffnesses k1 and k2 [N/mm].
    damping_ratio
        Damping ratio of all modes with the joints open, or one per mode; see
        :func:`fe_models.dynamics.rig.modal_damping`.

    Raises
    ------
    RigError
        If a specimen has no mass matrix or no names, or if the pads have different numbers of
        nodes.
    """
    parts = [_with_holder(lower, "lower"), _with_holder(upper, "upper", HOLDER)]
    names = [name for part in parts for name in part[2]]
    pads = [[name for name in part[2] if f" {PAD} " in name] for part in parts]
    if len(pads[0]) != len(pads[1]) or not pads[0]:
        raise RigError(
            f"the specimens have pads of {len(pads[0]) // 3} and {len(pads[1]) // 3} nodes: give "
            "specimens whose pads have the same nodes"
        )
    return connected_rig(
        sl.block_diag(*(part[0] for part in parts)),
        sl.block_diag(*(part[1] for part in parts)),
        tuple(names),
        {"m1 x": masses[0], "m2 x": masses[1], "m2 z": masses[1]},
        {Link("m1 x"): springs[0], Link("m2 x", "m1 x"): springs[1]},
        [
            [Link(above[0], below[0]), Link(above[1], below[1]), Link(below[2], above[2])]
            for below, above in zip(*(_by_node(pad) for pad in pads), strict=True)
        ],
        damping_ratio,
    )


def ground_inertia(
    lower: ReducedModel, upper: ReducedModel, masses: tuple[float, float], axis: str
) -> Array:
    """Return the masses M r ``(n,)`` [t] that move along an axis together with the ground.

    They include the holders. Where a ring is fixed to the ground, the terms of the mass matrix that
    couple the ring to the rest of its specimen count too.

    Parameters
    ----------
    lower, upper, masses
        As in :func:`friction_rig`.
    axis
        Axis of the motion: x, y or z.

    Raises
    ------
    RigError
        As in :func:`friction_rig`.
    """
    inertias = []
    for body, label, holder in ((lower, "lower", None), (upper, "upper", HOLDER)):
        tie, names = _tie(body, label, holder)
        assert body.mass is not None
        inertia = tie.T @ (body.mass @ translation_of(body, axis))
        lumped = {"m2 x": masses[1], "m2 z": masses[1]}
        holder_masses = [lumped.get(name, 0.0) * name.endswith(f" {axis}") for name in names]
        inertias.append(inertia + np.array(holder_masses))
    return np.concatenate([*inertias, [masses[0] * (axis == "x")]])


def _by_node(names: list[str]) -> list[list[str]]:
    """Group names by node: x, y and z of each."""
    return [names[start : start + 3] for start in range(0, len(names), 3)]


def _with_holder(
    body: ReducedModel, label: str, holder: dict[str, str] | None = None
) -> tuple[Array, Array, list[str]]:
    """Return mass and stiffness ``(c, c)`` of a specimen whose ring moves with its holder.

    The ring is fixed in the directions that ``holder`` lacks. The third result has the names
    ``(c,)`` of the remaining displacements, those of the holder last.
    """
    tie, names = _tie(body, label, holder)
    assert body.mass is not None
    return tie.T @ body.mass @ tie, tie.T @ body.stiffness @ tie, names


def _tie(body: ReducedModel, label: str, holder: dict[str, str] | None) -> tuple[Array, list[str]]:
    """Return the map ``(n, c)`` from the remaining displacements to a specimen, and their names.

    ``holder`` names the displacements of the ring's holder by direction; the ring is fixed in
    directions that it lacks.
    """
    if body.mass is None or body.names is None:
        raise RigError(
            f"the {label} specimen has no mass or no names: reduce it with its mass matrix and "
            "with names"
        )
    holder = holder or {}
    modes = [f"mode {mode + 1}" for mode in range(len(body.frequencies))]
    ring = [name.startswith(f"{RING} ") for name in body.names] + [False] * len(modes)
    free = np.flatnonzero(~np.array(ring))
    tie = np.zeros((len(ring), len(free) + len(holder)))
    tie[free, np.arange(len(free))] = 1.0
    for column, direction in enumerate(holder, len(free)):
        along = [name.endswith(f" {direction}") for name in body.names]
        tie[: len(along), column] = np.logical_and(ring[: len(along)], along)
    all_names = [*body.names, *modes]
    names = [f"{label} {all_names[index]}" for index in free] + list(holder.values())
    return tie, names
