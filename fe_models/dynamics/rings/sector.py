"""One of N equal sectors of a ring, in a wave that travels round the ring.

A force of engine order r passes one sector after the other: sector n moves as sector 0, but n
periods / (N / r) later. In harmonic h its motion is x_n = x_0 exp(-i n θ) with θ = 2π h r / N. The
wave has d = h r mod N nodal diameters and travels towards the next sector for d up to N/2; beyond,
it has N - d nodal diameters and travels in the opposite direction (Thomas, Int. J. Numer. Meth.
Eng. 14, 1979, 81; with friction Petrov, J. Eng. Gas Turb. Power 126, 2004, 175,
doi:10.1115/1.1639007). All unknowns of a sector, those that it shares with the next one included,
are T_d x with T_d = O + F exp(-iθ), and its matrices T_dᴴ A T_d are Hermitian.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.harmonics import ComplexArray
from fe_models.dynamics.rig import NOTHING, Link, RigError, modal_damping, undamped_rig
from fe_models.joints.reduction import ReducedModel
from sa_solver.types import Array

# Prefix of the names of points of the next sector.
NEXT = "next "
AXES = "xyz"
# Size of a component of a rotated direction below which it is rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Ring:
    """Ring of equal sectors, how they are joined, and the engine order of the excitation.

    Parameters
    ----------
    sectors
        Number of sectors, 2 or more.
    engine_order
        Engine order r of the excitation, 1 or more.
    ties
        Displacements of a cut face by name, tied to those of the next sector:
        ``{"right 1 x": "left 1 x"}``.
    axis
        Axis of the ring: x, y, z, -x, -y or -z. Each sector is rotated about it relative to the one
        before, and the displacements ``... x``, ``... y``, ``... z`` are along fixed axes. Without
        an axis the displacements are along axes that rotate with the sector, such as radial and
        tangential ones.

    Raises
    ------
    RigError
        If there are fewer than two sectors, if the order is below 1, or if the axis is unknown.

    Examples
    --------
    Engine order 5 acts on 12 blades. The wave of harmonic 1 has 5 nodal diameters. That of harmonic
    2 has 2 and travels backward, since 10 is 12 less 2.

    >>> from fe_models.dynamics.rings.sector import Ring
    >>> ring = Ring(sectors=12, engine_order=5)
    >>> print([ring.diameters(harmonic) for harmonic in (0, 1, 2, 3)])
    [0, 5, -2, 3]
    """

    sectors: int
    engine_order: int
    ties: Mapping[str, str] = field(default_factory=dict)
    axis: str | None = None

    def __post_init__(self) -> None:
        if self.sectors < 2 or self.engine_order < 1:
            raise RigError(
                f"a ring of {self.sectors} sectors with engine order {self.engine_order} is not "
                "possible: give 2 sectors or more, and an order of 1 or more"
            )
        if self.axis is not None and self.axis.removeprefix("-") not in tuple(AXES):
            raise RigError(f"the axis {self.axis!r} is unknown: give x, y, z, -x, -y or -z")

    def shift(self, harmonic: int) -> int:
        """Return d = h r mod N for a harmonic h: the phase from sector to sector is 2π d / N."""
        return (harmonic * self.engine_order) % self.sectors

    def diameters(self, harmonic: int) -> int:
        """Return the nodal diameters of a harmonic; negative for a wave that travels backward."""
        shift = self.shift(harmonic)
        return shift if 2 * shift <= self.sectors else shift - self.sectors

    def phase(self, shift: int) -> complex:
        """Return the phase factor exp(-iθ) of the next sector.

        It is real if all sectors move in phase, or each in antiphase to the next.
        """
        if 2 * shift % self.sectors == 0:
            return complex(1.0 if shift % self.sectors == 0 else -1.0)
        return complex(np.exp(-2j * np.pi * shift / self.sectors))

    def direction_in_next(self, direction: str) -> dict[str, float]:
        """Return a displacement direction of the next sector as a combination of its named ones."""
        if self.axis is None or direction.removeprefix("r") not in tuple(AXES):
            return {direction: 1.0}
        rotation = direction.removesuffix(direction[-1])
        row = _rotation(self.axis, 2.0 * np.pi / self.sectors)[AXES.index(direction[-1])]
        parts = zip(AXES, row.tolist(), strict=True)
        return {f"{rotation}{axis}": part for axis, part in parts if abs(part) > ROUNDING}


@dataclass(frozen=True)
class CyclicSector:
    """Sector of a ring, whose joints, springs and cut faces may connect to the next sector.

    Parameters
    ----------
    model
        Matrices of all unknowns ``(m,)``: those of the sector and those that it shares with the
        next one, which are named ``next ...`` or tied.
    own, following
        Matrices O and F ``(m, n)`` that make all unknowns from the sector's own ``(n,)`` and from
        those of the next sector.
    names
        Names ``(n,)`` of the sector's own unknowns.
    ring
        The ring.
    damping_ratio
        Damping ratio of its modes at each number of nodal diameters, from the lowest mode on.
    """

    model: DynamicModel
    own: Array
    following: Array
    names: tuple[str, ...]
    ring: Ring
    damping_ratio: float | Array = 0.0

    def at(self, shift: int) -> DynamicModel:
        """Return the matrices ``(n, n)`` and joints of the sector in a wave.

        ``shift`` is the phase index of :meth:`Ring.shift`. The matrices are real for 0 and N/2.
        """
        transformation, model = self._transformation(shift), self.model
        adjoint = transformation.conj().T
        mass, damping, stiffness = (
            adjoint @ part @ transformation for part in (model.mass, model.damping, model.stiffness)
        )
        damping = damping + modal_damping(mass, stiffness, self.damping_ratio)
        structural = (
            None if model.structural is None else adjoint @ model.structural @ transformation
        )
        connection = model.connection @ transformation
        return DynamicModel(mass, damping, stiffness, connection, self.names, structural)

    def force(self, force: Array, shift: int) -> ComplexArray:
        """Return forces ``(n,)`` on the own unknowns for forces ``(m,)`` on all, in a wave.

        ``shift`` is the phase index of :meth:`Ring.shift`.
        """
        return np.asarray(force @ self._transformation(shift).conj())

    def _transformation(self, shift: int) -> ComplexArray:
        """Return T_d ``(m, n)``, real where it can be."""
        phase = self.ring.phase(shift)
        return np.asarray(self.own + self.following * (phase if phase.imag else phase.real))

    def whole(self) -> DynamicModel:
        """Return the real model of all sectors, one after the other ``(N n,)``, for comparison."""
        shifts = range(self.ring.sectors)
        transformations = [
            np.kron(row, self.own) + np.kron(np.roll(row, 1), self.following)
            for row in np.eye(self.ring.sectors)
        ]
        model = self.model
        mass, damping, stiffness = (
            sum(turn.T @ part @ turn for turn in transformations)
            for part in (model.mass, model.damping, model.stiffness)
        )
        undamped = replace(model, damping=np.zeros_like(model.damping))
        damping_by_shift = [replace(self, model=undamped).at(shift).damping for shift in shifts]
        for sector in shifts:
            # Coupling to the next sectors: the inverse Fourier transform over all numbers of nodal
            # diameters.
            phases = [self.ring.phase(shift * sector) for shift in shifts]
            block = sum(p * part for p, part in zip(phases, damping_by_shift, strict=True)).real
            at_next = np.roll(np.eye(self.ring.sectors), sector, axis=0)
            damping = damping + np.kron(at_next, block) / self.ring.sectors
        structural = model.structural
        if structural is not None:
            structural = np.asarray(sum(turn.T @ structural @ turn for turn in transformations))
        return DynamicModel(
            np.asarray(mass),
            np.asarray(damping),
            np.asarray(stiffness),
            np.vstack([model.connection @ transformation for transformation in transformations]),
            tuple(f"{name} of {sector}" for sector in shifts for name in self.names),
            structural,
        )


def lumped_sector(
    masses: Mapping[str, float],
    springs: Mapping[Link, float],
    joints: Sequence[Sequence[Link]],
    ring: Ring,
    damping_ratio: float | Array = 0.0,
) -> CyclicSector:
    """Return a sector of masses and springs, with joints.

    Masses move along one line, or around the ring.

    Parameters
    ----------
    masses, springs, joints, damping_ratio
        As in :func:`fe_models.dynamics.lumped_rig`. Points of the next sector are named
        ``next ...``, as in ``Link("a", "next a")``.
    ring
        The ring.

    Examples
    --------
    Masses of 1 kg stand on springs of 1 N/µm, and a spring of the same stiffness joins each mass to
    the next one. With d nodal diameters ω² = (k + 4 k sin²(π d/N)) / m.

    >>> import numpy as np
    >>> from fe_models.dynamics import Link, natural_frequencies
    >>> from fe_models.dynamics.rings.sector import Ring, lumped_sector
    >>> springs = {Link("a"): 1e3, Link("next a", "a"): 1e3}
    >>> sector = lumped_sector({"a": 1e-3}, springs, [[Link("a")]], Ring(6, engine_order=1))
    >>> found = [2.0 * np.pi * natural_frequencies(sector.at(d))[0] for d in range(4)]
    >>> print(np.round(found, 2))
    [1000.   1414.21 2000.   2236.07]
    >>> print((1e3 * np.sqrt(1.0 + 4.0 * np.sin(np.pi * np.arange(4) / 6.0) ** 2)).round(2))
    [1000.   1414.21 2000.   2236.07]
    """
    empty = np.zeros((0, 0))
    return _sector(empty, empty, None, (), (), masses, springs, joints, ring, damping_ratio)


def reduced_sector(
    reduced: ReducedModel,
    names: Sequence[str],
    joints: Sequence[Sequence[Link]],
    ring: Ring,
    masses: Mapping[str, float] = NOTHING,
    springs: Mapping[Link, float] | None = None,
    damping_ratio: float | Array = 0.0,
) -> CyclicSector:
    """Return a sector made of a reduced body, with masses, springs and joints added.

    Parameters
    ----------
    reduced
        The reduced body, with its mass matrix.
    names
        Names ``(c,)`` of its kept displacements, those of the cut faces included.
    joints, masses, springs, damping_ratio
        As in :func:`fe_models.dynamics.reduced_rig`. Points of the next sector are named
        ``next ...``.
    ring
        The ring.

    Raises
    ------
    RigError
        If a tie names a displacement that does not exist, or as in
        :func:`fe_models.dynamics.reduced_rig`.

    Examples
    --------
    A rod joins two masses, of which the second is the first of the next sector. With one nodal
    diameter in four sectors, a mass m has ω² = 4 k/m sin²(π/4).

    >>> import numpy as np
    >>> from fe_models import ReducedModel
    >>> from fe_models.dynamics import natural_frequencies
    >>> from fe_models.dynamics.rings.sector import Ring, reduced_sector
    >>> rod, halves = 1e3 * np.array([[1.0, -1.0], [-1.0, 1.0]]), 1e-3 * np.diag([0.5, 0.5])
    >>> none = np.zeros((2, 0))
    >>> body = ReducedModel(np.arange(2), rod, halves, none, none, np.zeros(0))
    >>> ring = Ring(4, engine_order=1, ties={"right x": "left x"})
    >>> sector = reduced_sector(body, ("left x", "right x"), [], ring)
    >>> print((2.0 * np.pi * natural_frequencies(sector.at(1))).round(2))
    [1414.21]
    """
    if reduced.mass is None:
        raise RigError("the reduced model has no mass: reduce the body with its mass matrix")
    modes = tuple(f"mode {mode + 1}" for mode in range(len(reduced.frequencies)))
    return _sector(
        *(reduced.mass, reduced.stiffness, reduced.damping),
        *(tuple(names), modes),
        masses,
        springs or {},
        joints,
        ring,
        damping_ratio,
    )


def _sector(
    mass: Array,
    stiffness: Array,
    damping: Array | None,
    names: tuple[str, ...],
    modes: tuple[str, ...],
    masses: Mapping[str, float],
    springs: Mapping[Link, float],
    joints: Sequence[Sequence[Link]],
    ring: Ring,
    damping_ratio: float | Array,
) -> CyclicSector:
    """Return a sector from matrices of displacements ``names`` and ``modes``, and what is added."""
    sector_names = (*names, *modes, *(name for name in masses if name not in names))
    own = tuple(name for name in sector_names if name not in ring.ties)
    _check_ties(ring.ties, sector_names, own)
    free = (name for name in own if name not in modes)
    shared = {
        f"{NEXT}{name}": combination
        for name in free
        if (combination := _combination(ring, name, own))
    }
    tied = {name: _combination(ring, to, own) for name, to in ring.ties.items()}
    if not all(tied.values()):
        raise RigError(
            f"points tied to the next sector, rotated about {ring.axis}, lack some directions of "
            "displacement: keep all three"
        )
    all_names = (*sector_names, *shared)
    model = undamped_rig(mass, stiffness, all_names, masses, springs, joints)
    if damping is not None:
        model = replace(model, damping=np.pad(damping, (0, len(all_names) - len(damping))))
    at_own, at_next = (np.zeros((len(all_names), len(own))) for _ in range(2))
    for index, name in enumerate(own):
        at_own[all_names.index(name), index] = 1.0
    for name, combination in (shared | tied).items():
        for of, part in combination.items():
            at_next[all_names.index(name), own.index(of)] += part
    return CyclicSector(model, at_own, at_next, own, ring, damping_ratio)


def _check_ties(ties: Mapping[str, str], sector_names: Sequence[str], own: Sequence[str]) -> None:
    """Raise :class:`RigError` if a tie does not join a sector's displacement to an own one."""
    for name, to in ties.items():
        if name not in sector_names or to not in own:
            wrong = name if name not in sector_names else to
            raise RigError(
                f"the tie to the next sector names {wrong}: give one of the sector's own "
                "displacements, once"
            )


def _combination(ring: Ring, name: str, own: Sequence[str]) -> dict[str, float]:
    """Return a displacement of the next sector in terms of its names.

    The result is empty if some of these names do not exist.
    """
    point, _, direction = name.rpartition(" ")
    if not point:
        return {name: 1.0}
    combination = {
        f"{point} {axis}": share for axis, share in ring.direction_in_next(direction).items()
    }
    return combination if all(share in own for share in combination) else {}


def _rotation(axis: str, angle: float) -> Array:
    """Return the right-handed rotation about an axis; its columns are the rotated x, y and z."""
    about = AXES.index(axis[-1])
    first, second = (about + 1) % 3, (about + 2) % 3
    signed = -angle if axis.startswith("-") else angle
    turned = np.eye(3)
    turned[[first, second], [first, second]] = np.cos(signed)
    turned[second, first], turned[first, second] = np.sin(signed), -np.sin(signed)
    return turned
