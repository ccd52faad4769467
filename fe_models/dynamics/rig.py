"""Rigs: lumped masses, springs and reduced bodies that vibrate, with joints between named points.

Modal damping is defined for the rig with its joints free, so that a rig without friction rings down
with the damping ratios that were measured: C = M Φ diag(2 ζ ω) Φᵀ M with Φᵀ M Φ = I.
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
# Number of names that a message lists at most.
MOST_LISTED = 12


class RigError(InputError):
    """Error in the description of a rig, so that it cannot be built."""


@dataclass(frozen=True)
class Link:
    """Link that stretches by the displacement of ``second`` relative to ``first``; None is ground.

    Examples
    --------
    A spring of 1 N/µm joins two free masses of 1 kg: ω = 0 and √(2 k/m).

    >>> import numpy as np
    >>> from fe_models.dynamics import Link, lumped_rig, natural_frequencies
    >>> between = Link(second="b", first="a")
    >>> rig = lumped_rig({"a": 1e-3, "b": 1e-3}, {between: 1e3}, [[between]])
    >>> print((2.0 * np.pi * natural_frequencies(rig)).round(2), rig.connection)
    [   0.   1414.21] [[-1.  1.]]
    """

    second: str | None
    first: str | None = None

    def __post_init__(self) -> None:
        # A direction that a joint lacks joins ground to ground.
        if self.second is not None and self.second == self.first:
            raise RigError(
                f"a link joins {self.second} to itself and never stretches: give two points, or "
                "one and ground"
            )


def lumped_rig(
    masses: Mapping[str, float],
    springs: Mapping[Link, float],
    joints: Sequence[Sequence[Link]],
    damping_ratio: float | Array = 0.0,
) -> DynamicModel:
    """Return a rig of masses and springs that move along one line, with joints.

    Parameters
    ----------
    masses
        Mass [t] of each point, by its name.
    springs
        Stiffness [N/mm] of each spring, by the link that it joins.
    joints
        One link per direction for every joint.
    damping_ratio
        Modal damping ratio: one for all modes, or one per mode from the lowest on. If there are
        fewer ratios than modes, the last one holds for all higher modes.

    Raises
    ------
    RigError
        If a link names a point without a mass, or a mass is not above zero.

    Examples
    --------
    Two masses of 1 kg stand in a row on springs of 1 N/µm: ω² = (3 ∓ √5)/2 k/m.

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
    """Return a rig made of a reduced body, with lumped masses, springs and joints added.

    Parameters
    ----------
    reduced
        The reduced body, with its mass matrix. Its damping matrix, if any, is added to the modal
        damping.
    names
        Names ``(c,)`` of the kept displacements of the body. Its modes are named ``mode 1``,
        ``mode 2``, ...
    joints
        One link per direction for every joint. The displacement of a joint is that of the second
        point less that of the first.
    masses
        Lumped masses [t] by name. A name that the body does not have adds a point.
    springs
        Stiffness [N/mm] of each spring, by the link that it joins.
    damping_ratio
        Modal damping ratio of the rig, as in :func:`lumped_rig`.

    Raises
    ------
    RigError
        If the body has no mass matrix, if names and kept displacements differ in number, or as in
        :func:`lumped_rig`.

    Examples
    --------
    Eleven masses and ten springs in a row are reduced to the two ends and eight modes. The row is
    free, and its first elastic mode has ω = 2 √(k/m) sin(π/22).

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
        raise RigError(
            "the reduced model has no mass: reduce the body together with its mass matrix"
        )
    if len(names) != len(reduced.kept):
        raise RigError(
            f"there are {len(names)} names for {len(reduced.kept)} kept displacements: give one "
            "name for each"
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
    """Return a rig made of given matrices, with masses, springs and joints added.

    Parameters
    ----------
    mass, stiffness
        Matrices ``(c, c)`` [t, N/mm] of the displacements ``names``.
    names
        Names ``(c,)`` of these displacements.
    masses, springs, joints, damping_ratio
        As in :func:`reduced_rig`.
    """
    all_names = names + tuple(name for name in masses if name not in names)
    rig = undamped_rig(mass, stiffness, all_names, masses, springs, joints)
    return replace(rig, damping=modal_damping(rig.mass, rig.stiffness, damping_ratio))


def undamped_rig(
    mass: Array,
    stiffness: Array,
    names: tuple[str, ...],
    masses: Mapping[str, float],
    springs: Mapping[Link, float],
    joints: Sequence[Sequence[Link]],
) -> DynamicModel:
    """Return a rig without damping; see :func:`connected_rig`.

    Parameters
    ----------
    mass, stiffness
        Matrices ``(c, c)`` [t, N/mm] of the first ``c`` of the displacements ``names``.
    names
        Names ``(n,)`` of all displacements, those that ``masses`` add included.
    masses, springs, joints
        As in :func:`reduced_rig`.
    """
    if len(set(names)) < len(names):
        raise RigError("two points have the same name: give every point a name of its own")
    added = len(names) - len(mass)
    mass, stiffness = (np.pad(matrix, (0, added)) for matrix in (mass, stiffness))
    for name, value in masses.items():
        checks.number(f"mass of {name}", value, error=RigError)
        row = _index(names, name)
        mass[row, row] += value
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
    """Return the damping matrix C = M Φ diag(2 ζ ω) Φᵀ M ``(n, n)`` for given damping ratios.

    Rigid motions (ω = 0) count as modes and are not damped.

    Parameters
    ----------
    mass, stiffness
        Matrices ``(n, n)`` [t, N/mm].
    ratio
        Damping ratio ζ of all modes, or one per mode from the lowest on. If there are fewer ratios
        than modes, the last one holds for all higher modes.

    Raises
    ------
    RigError
        If the mass matrix is not positive definite, if a ratio is below zero, or if there are more
        ratios than modes.
    """
    given = np.atleast_1d(checks.array("damping ratios", ratio, None, error=RigError))
    if given.ndim > 1 or np.any(given < 0.0):
        raise RigError(f"damping ratio {given.min(initial=0.0):g}: give one or (n,), 0 or more")
    if not 0 < len(given) <= len(mass):
        raise RigError(
            f"there are {len(given)} damping ratios for {len(mass)} modes: give at least one, at "
            "most one for each mode"
        )
    try:
        squares, shapes = sl.eigh(stiffness, mass)
    except np.linalg.LinAlgError:
        raise RigError(
            "the mass matrix is not positive definite: give every point mass above 0"
        ) from None
    angular = np.sqrt(np.maximum(squares, 0.0))
    moved = mass @ shapes
    ratios = np.pad(given, (0, len(mass) - len(given)), mode="edge")
    return np.asarray((moved * (2.0 * ratios * angular)) @ moved.conj().T)


def natural_frequencies(model: DynamicModel, joint_stiffness: float | Array = 0.0) -> Array:
    """Return the undamped natural frequencies ``(n,)`` [Hz], with springs in place of the joints.

    Rigid motions have the frequency 0.

    Parameters
    ----------
    model
        The structure.
    joint_stiffness
        Stiffness [N/mm] of these springs: one value for all, one per row of the connection
        ``(j d,)``, or tangents ``(j, d, d)``. Zero leaves the joints free.

    Examples
    --------
    A joint that sticks acts as one more spring, ω = √((k + kt)/m):

    >>> import numpy as np
    >>> from fe_models.dynamics import Link, lumped_rig, natural_frequencies
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]])
    >>> free, stuck = natural_frequencies(rig)[0], natural_frequencies(rig, joint_stiffness=3e3)[0]
    >>> print(f"{stuck / free:.6f}")
    2.000000
    """
    stretch = model.connection
    stiffnesses = checks.array("joint stiffnesses", joint_stiffness, None, error=RigError)
    size = stiffnesses.size if stiffnesses.ndim else len(stretch)
    if stiffnesses.ndim == 3:
        size = len(stiffnesses) * stiffnesses.shape[1]
    if stiffnesses.ndim == 2 or size != len(stretch):
        raise RigError(
            f"joint stiffnesses of shape {stiffnesses.shape} for {len(stretch)} rows of the "
            "connection: give one, one for each row, or the tangents of the joints"
        )
    if stiffnesses.ndim == 3:
        springs = sl.block_diag(*stiffnesses)
    else:
        springs = np.diag(np.broadcast_to(stiffnesses, len(stretch)))
    squares = sl.eigh(
        model.stiffness + stretch.conj().T @ springs @ stretch, model.mass, eigvals_only=True
    )
    return np.asarray(
        np.sqrt(np.where(squares < RIGID * squares[-1], 0.0, squares)) / (2.0 * np.pi)
    )


def unit_force(model: DynamicModel, name: str) -> Array:
    """Return a force of 1 N on the point ``name``, as a vector ``(n,)``.

    Raises
    ------
    RigError
        If the model has no such point.

    Examples
    --------
    A force of 1 N acts on the second of two masses:

    >>> from fe_models.dynamics import Link, lumped_rig, unit_force
    >>> rig = lumped_rig({"a": 1e-3, "b": 1e-3}, {Link("a"): 1e3, Link("b", "a"): 1e3}, [])
    >>> print(unit_force(rig, "b"))
    [0. 1.]
    """
    force = np.zeros(len(model.names))
    force[_index(model.names, name)] = 1.0
    return force


def _connection(names: tuple[str, ...], joints: Sequence[Sequence[Link]]) -> Array:
    """Return the connection matrix B ``(j d, n)``; all joints must have the same directions."""
    if len({len(joint) for joint in joints}) > 1:
        raise RigError(
            "joints have different numbers of directions: give every joint as many links"
        )
    rows = [stretch_of(names, link) for joint in joints for link in joint]
    return np.array(rows).reshape(len(rows), len(names))


def stretch_of(names: tuple[str, ...], link: Link) -> Array:
    """Return the row ``(n,)`` that maps displacements of all points to the stretch of a link."""
    row = np.zeros(len(names))
    for name, sign in ((link.second, 1.0), (link.first, -1.0)):
        if name is not None:
            row[_index(names, name)] += sign
    return row


def _index(names: tuple[str, ...], name: str) -> int:
    if name not in names:
        more = ", ..." if len(names) > MOST_LISTED else ""
        listed = ", ".join(names[:MOST_LISTED]) + more
        raise RigError(f"there is no point {name!r}: the rig has {listed}")
    return names.index(name)
