"""The friction rig with the two specimens in contact: two reduced bodies and two masses.

    ground - k1 - m1 - k2 - m2 = ring of the upper specimen, pads, ring of the lower one = ground

The holder of the upper specimen is rigid with m2, which moves along x and z and does not turn; that
of the lower one is the ground. m1 moves along x. Only the contact and the load on m2 hold anything
along z. The specimens stand in their interface's frame, the upper one at z > 0.

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

# How the holder of the upper specimen moves.
HOLDER = {"x": "m2 x", "z": "m2 z"}


def friction_rig(
    lower: ReducedModel,
    upper: ReducedModel,
    masses: tuple[float, float],
    springs: tuple[float, float],
    damping_ratio: float | Array = 0.0,
) -> DynamicModel:
    """Both specimens and the rig, a joint of three directions at every pair of pad nodes.

    ``masses`` m1, m2 [t], ``springs`` k1, k2 [N/mm], ``damping_ratio`` that of all modes with the
    joints open. Displacements are ``m1 x``, ``m2 x``, ``m2 z`` and those of the specimens, such as
    ``lower pad 17 x``. Joints stretch along x and y as the upper pad moves over the lower one, and
    along z as it comes closer. Raises :class:`RigError` for bodies without mass, without names or
    with unlike pads.
    """
    parts = [_held(lower, "lower"), _held(upper, "upper", HOLDER)]
    names = [name for part in parts for name in part[2]]
    pads = [[name for name in part[2] if f" {PAD} " in name] for part in parts]
    if len(pads[0]) != len(pads[1]) or not pads[0]:
        raise RigError(
            f"pads of {len(pads[0]) // 3} and {len(pads[1]) // 3} nodes: give specimens with pads "
            "of as many"
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
    """M r ``(n,)`` [t] of the rig that moves along an axis with its ground, the holders included.

    Where the holders do not move against the ground, what joins their mass to that of the specimens
    counts. Raises :class:`RigError` as :func:`friction_rig`.
    """
    moved = []
    for body, label, holder in ((lower, "lower", None), (upper, "upper", HOLDER)):
        tie, names = _tie(body, label, holder)
        assert body.mass is not None
        inertia = tie.T @ (body.mass @ translation_of(body, axis))
        lumped = {"m2 x": masses[1], "m2 z": masses[1]}
        held = [lumped.get(name, 0.0) * name.endswith(f" {axis}") for name in names]
        moved.append(inertia + np.array(held))
    return np.concatenate([*moved, [masses[0] * (axis == "x")]])


def _by_node(names: list[str]) -> list[list[str]]:
    """Names of x, y and z of each node."""
    return [names[start : start + 3] for start in range(0, len(names), 3)]


def _held(
    body: ReducedModel, label: str, holder: dict[str, str] | None = None
) -> tuple[Array, Array, list[str]]:
    """Mass and stiffness ``(c, c)`` of a body whose ring is held, or moves as its ``holder``.

    Also the names ``(c,)`` of the displacements that are left: the holder's last.
    """
    tie, names = _tie(body, label, holder)
    assert body.mass is not None
    return tie.T @ body.mass @ tie, tie.T @ body.stiffness @ tie, names


def _tie(body: ReducedModel, label: str, holder: dict[str, str] | None) -> tuple[Array, list[str]]:
    """What the displacements that are left ``(c,)`` move of a body, ``(n, c)``, and their names.

    The holder is named by direction; directions that it lacks are held.
    """
    if body.mass is None or body.names is None:
        raise RigError(f"the {label} specimen has no mass or no names: reduce it with both")
    holder = holder or {}
    modes = [f"mode {mode + 1}" for mode in range(len(body.frequencies))]
    ring = [name.startswith(f"{RING} ") for name in body.names] + [False] * len(modes)
    free = np.flatnonzero(~np.array(ring))
    tie = np.zeros((len(ring), len(free) + len(holder)))
    tie[free, np.arange(len(free))] = 1.0
    for column, direction in enumerate(holder, len(free)):
        along = [name.endswith(f" {direction}") for name in body.names]
        tie[: len(along), column] = np.logical_and(ring[: len(along)], along)
    every = [*body.names, *modes]
    names = [f"{label} {every[place]}" for place in free] + list(holder.values())
    return tie, names
