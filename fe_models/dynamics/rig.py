"""Rigs: lumped masses, springs and reduced bodies that vibrate, and where their joints are.

Points are known by their names. Damping is that of the modes with the joints free, so that a rig
without friction rings down as measured: C = M Φ diag(2 ζ ω) Φᵀ M with Φᵀ M Φ = I.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.receptance import RIGID
from fe_models.joints.reduction import ReducedModel
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array

NOTHING: Mapping[str, float] = {}
# Names that fit into a message.
MOST_LISTED = 12


class RigError(InputError):
    """A rig that cannot be built from what was given."""


@dataclass(frozen=True)
class Link:
    """What stretches by the displacement of ``second`` relative to ``first``; None is ground.

    Examples
    --------
    Two masses of 1 kg that a link of 1 N/µm joins and nothing holds: ω = 0 and √(2 k/m)

    >>> import numpy as np
    >>> from fe_models.dynamics import Link, lumped_rig, natural_frequencies
    >>> between = Link(second="b", first="a")
    >>> rig = lumped_rig({"a": 1e-3, "b": 1e-3}, {between: 1e3}, [[between]])
    >>> print((2.0 * np.pi * natural_frequencies(rig)).round(2), rig.connection)
    [   0.   1414.21] [[-1.  1.]]
    """

    second: str | None
    first: str | None = None


def lumped_rig(
    masses: Mapping[str, float],
    springs: Mapping[Link, float],
    joints: Sequence[Sequence[Link]],
    damping_ratio: float | Array = 0.0,
) -> DynamicModel:
    """Masses [t] and springs [N/mm] that move along one line, with joints.

    Every joint is one link per direction. ``damping_ratio`` is one, or that of each mode ``(n,)``,
    from the lowest on; of fewer the last is that of all beyond. Raises :class:`RigError` for a name
    that is not a mass, or a mass that is not above zero.

    Examples
    --------
    Two masses of 1 kg in a row on springs of 1 N/µm: ω² = (3 ∓ √5)/2 k/m

    >>> import numpy as np
    >>> from fe_models.dynamics import Link, lumped_rig, natural_frequencies
    >>> springs = {Link("a"): 1e3, Link("b", "a"): 1e3}
    >>> rig = lumped_rig({"a": 1e-3, "b": 1e-3}, springs, joints=[[Link("b")]])
    >>> print((2.0 * np.pi * natural_frequencies(rig)).round(2))
    [ 618.03 1618.03]
    >>> print((1e3 * np.sqrt(0.5 * (3.0 + np.sqrt(5.0) * np.array([-1.0, 1.0])))).round(2))
    [ 618.03 1618.03]
    """
    empty = np.zeros((0, 0))
    return connected_rig(empty, empty, (), masses, springs, joints, damping_ratio)


def reduced_rig(
    reduced: ReducedModel,
    names: Sequence[str],
    joints: Sequence[Sequence[Link]],
    masses: Mapping[str, float] = NOTHING,
    springs: Mapping[Link, float] | None = None,
    damping_ratio: float | Array = 0.0,
) -> DynamicModel:
    """A reduced body, with lumped masses [t] and springs [N/mm] added to it, and joints.

    ``names`` ``(c,)`` are those of its kept displacements; its modes follow as ``mode 1`` ... A
    mass of another name is a further point. Every joint is one link per direction, its
    displacement the second's minus the first's. ``damping_ratio`` is one, or that of each mode
    ``(n,)`` of the rig, as of :func:`lumped_rig`; a damping matrix of the body comes to it. Raises
    :class:`RigError` for a model without mass, for names that are not as many as the kept
    displacements, and as :func:`lumped_rig`.

    Examples
    --------
    Eleven masses and ten springs in a row, reduced to the ends and eight modes: it is free, and
    vibrates at 2 √(k/m) sin(π/22).

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models import reduce_body
    >>> from fe_models.dynamics import Link, natural_frequencies, reduced_rig
    >>> row = sp.diags([-1e3, 2e3, -1e3], [-1, 0, 1], shape=(11, 11), format="lil")
    >>> row[0, 0] = row[10, 10] = 1e3
    >>> mass = 1e-3 * sp.identity(11, format="csr")
    >>> body = reduce_body(row.tocsr(), mass, np.array([0, 10]), modes=8)
    >>> rig = reduced_rig(body, ("left", "right"), joints=[[Link("right", "left")]])
    >>> lowest = 2.0 * np.pi * natural_frequencies(rig)[1]
    >>> print(f"{lowest:.2f} rad/s of {2e3 * np.sin(np.pi / 22.0):.2f}")
    284.63 rad/s of 284.63
    """
    if not isinstance(reduced, ReducedModel):
        raise RigError(f"a {type(reduced).__name__} in place of a reduced body: give one")
    if reduced.mass is None:
        raise RigError("the reduced model has no mass: reduce the body with its mass matrix")
    if len(names) != len(reduced.kept):
        raise RigError(
            f"{len(names)} names for {len(reduced.kept)} kept displacements: give one for each"
        )
    modes = tuple(f"mode {mode + 1}" for mode in range(len(reduced.frequencies)))
    named = (*names, *modes)
    rig = connected_rig(
        reduced.mass, reduced.stiffness, named, masses, springs or {}, joints, damping_ratio
    )
    if reduced.damping is None:
        return rig
    added = len(rig.mass) - len(named)
    return replace(rig, damping=rig.damping + np.pad(reduced.damping, (0, added)))


def connected_rig(
    mass: Array,
    stiffness: Array,
    names: tuple[str, ...],
    masses: Mapping[str, float],
    springs: Mapping[Link, float],
    joints: Sequence[Sequence[Link]],
    damping_ratio: float | Array = 0.0,
) -> DynamicModel:
    """Masses and springs added to the matrices ``(c, c)`` of displacements ``names``, and joints.

    As :func:`reduced_rig`, whatever the matrices come from.
    """
    every = names + tuple(name for name in masses if name not in names)
    rig = undamped_rig(mass, stiffness, every, masses, springs, joints)
    return replace(rig, damping=modal_damping(rig.mass, rig.stiffness, damping_ratio))


def undamped_rig(
    mass: Array,
    stiffness: Array,
    names: tuple[str, ...],
    masses: Mapping[str, float],
    springs: Mapping[Link, float],
    joints: Sequence[Sequence[Link]],
) -> DynamicModel:
    """The same without damping, of all ``names``: matrices are of the first of them."""
    if len(set(names)) < len(names):
        raise RigError("two points have the same name: give each its own")
    added = len(names) - len(mass)
    mass, stiffness = (np.pad(matrix, (0, added)) for matrix in (mass, stiffness))
    for name, value in masses.items():
        checks.number(f"mass of {name}", value, error=RigError)
        place = _place(names, name)
        mass[place, place] += value
    for link, value in springs.items():
        checks.number(f"spring of {link}", value, error=RigError)
        stretch = stretch_of(names, link)
        stiffness += value * np.outer(stretch, stretch)
    return DynamicModel(
        mass=mass,
        damping=np.zeros_like(mass),
        stiffness=stiffness,
        connection=_connection(names, joints),
        names=names,
    )


def modal_damping(mass: Array, stiffness: Array, ratio: float | Array) -> Array:
    """C = M Φ diag(2 ζ ω) Φᵀ M ``(n, n)`` with ``ratio`` ζ of all modes, or of each ``(n,)``.

    Of fewer ratios, from the lowest mode on, the last is that of all modes beyond. Rigid motions
    (ω = 0) are modes too, and are not damped. Raises :class:`RigError` if the mass is not positive
    definite, or a ratio is below zero, or there are more of them than modes.
    """
    given = np.atleast_1d(checks.array("damping ratios", ratio, None, error=RigError))
    if given.ndim > 1 or np.any(given < 0.0):
        raise RigError(f"damping ratio {given.min(initial=0.0):g}: give one or (n,), 0 or more")
    if not 0 < len(given) <= len(mass):
        raise RigError(f"{len(given)} damping ratios for {len(mass)} modes: give one for each")
    try:
        squares, shapes = sl.eigh(stiffness, mass)
    except np.linalg.LinAlgError:
        raise RigError("the mass matrix is not positive definite: give every point mass") from None
    angular = np.sqrt(np.maximum(squares, 0.0))
    moved = mass @ shapes
    ratios = np.pad(given, (0, len(mass) - len(given)), mode="edge")
    return np.asarray((moved * (2.0 * ratios * angular)) @ moved.conj().T)


def natural_frequencies(model: DynamicModel, joint_stiffness: float | Array = 0.0) -> Array:
    """Natural frequencies ``(n,)`` [Hz], undamped, with springs in place of the joints.

    ``joint_stiffness`` [N/mm] is one for all, one for each row of the connection ``(j d,)``, or
    the joints' tangents ``(j, d, d)``. Zero leaves the joints free. Rigid motions have 0.

    Examples
    --------
    A joint that sticks is one more spring, √((k + kt)/m):

    >>> import numpy as np
    >>> from fe_models.dynamics import Link, lumped_rig, natural_frequencies
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]])
    >>> free, stuck = natural_frequencies(rig)[0], natural_frequencies(rig, joint_stiffness=3e3)[0]
    >>> print(f"{stuck / free:.6f}")
    2.000000
    """
    stretch = model.connection
    held = checks.array("joint stiffnesses", joint_stiffness, None, error=RigError)
    size = len(held) * held.shape[1] if held.ndim == 3 else held.size if held.ndim else len(stretch)
    if held.ndim == 2 or size != len(stretch):
        raise RigError(
            f"joint stiffnesses of shape {held.shape} for {len(stretch)} rows of the connection: "
            "give one, one for each row, or the tangents of the joints"
        )
    if held.ndim == 3:
        springs = sl.block_diag(*held)
    else:
        springs = np.diag(np.broadcast_to(held, len(stretch)))
    squares = sl.eigh(
        model.stiffness + stretch.conj().T @ springs @ stretch, model.mass, eigvals_only=True
    )
    return np.asarray(
        np.sqrt(np.where(squares < RIGID * squares[-1], 0.0, squares)) / (2.0 * np.pi)
    )


def unit_force(model: DynamicModel, name: str) -> Array:
    """A force of 1 N on the point ``name``, as ``(n,)``. Raises :class:`RigError` if unknown.

    Examples
    --------
    1 N on the second of two masses:

    >>> from fe_models.dynamics import Link, lumped_rig, unit_force
    >>> rig = lumped_rig({"a": 1e-3, "b": 1e-3}, {Link("a"): 1e3, Link("b", "a"): 1e3}, [])
    >>> print(unit_force(rig, "b"))
    [0. 1.]
    """
    force = np.zeros(len(model.names))
    force[_place(model.names, name)] = 1.0
    return force


def _connection(names: tuple[str, ...], joints: Sequence[Sequence[Link]]) -> Array:
    """B ``(j d, n)``. All joints have the same directions."""
    if len({len(joint) for joint in joints}) > 1:
        raise RigError("joints of different numbers of directions: give all the same")
    rows = [stretch_of(names, link) for joint in joints for link in joint]
    return np.array(rows).reshape(len(rows), len(names))


def stretch_of(names: tuple[str, ...], link: Link) -> Array:
    """The row that takes the displacements of all points to the stretch of a link."""
    row = np.zeros(len(names))
    for name, sign in ((link.second, 1.0), (link.first, -1.0)):
        if name is not None:
            row[_place(names, name)] += sign
    return row


def _place(names: tuple[str, ...], name: str) -> int:
    if name not in names:
        more = ", ..." if len(names) > MOST_LISTED else ""
        listed = ", ".join(names[:MOST_LISTED]) + more
        raise RigError(f"there is no point {name!r}: the rig has {listed}")
    return names.index(name)
