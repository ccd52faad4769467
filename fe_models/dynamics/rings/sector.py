"""One of N like sectors of a ring, in a wave that travels round it.

A force of engine order r passes each sector after the one before: the motion of sector n is that of
sector 0, n periods / (N / r) later. Harmonic h of it is x_n = x_0 exp(-i n θ), θ = 2π h r / N: the
wave has d = h r mod N nodal diameters, travelling toward the next sector up to N/2, and N - d the
other way beyond (Thomas, Int. J. Numer. Meth. Eng. 14, 1979, 81; with friction Petrov, J. Eng. Gas
Turb. Power 126, 2004, 175, doi:10.1115/1.1639007). With what a sector shares with the next, all its
unknowns are T_d x, T_d = O + F exp(-iθ), and its matrices T_dᴴ A T_d are Hermitian.
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

# What the points of the next sector are named by.
NEXT = "next "
AXES = "xyz"
# Below it a part of a turned direction is rounding.
ACROSS = 1e-12


@dataclass(frozen=True)
class Ring:
    """How like ``sectors`` join, and the ``engine_order`` r of what drives them.

    ``ties`` are displacements of a sector that are those of the next one by name, of the face on
    which it is cut: ``{"right 1 x": "left 1 x"}``. About an ``axis`` x, y, z (or -x, -y, -z) each
    sector is turned by a whole turn over their number from the one before, and the displacements
    ``... x``, ``... y``, ``... z`` of a point are along axes that do not turn; without it they are
    along axes that turn with the sector, as radial and tangential ones. Raises :class:`RigError`
    for fewer than two sectors, an order below 1, or an unknown axis.

    Examples
    --------
    Engine order 5 on 12 blades: the wave of harmonic 1 has 5 nodal diameters, harmonic 2 has 2 and
    travels backward, as 10 is 2 less than all.

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
                f"{self.sectors} sectors, engine order {self.engine_order}: give 2 sectors or "
                "more, and an order of 1 or more"
            )
        if self.axis is not None and self.axis.removeprefix("-") not in tuple(AXES):
            raise RigError(f"axis {self.axis!r}: give x, y, z, -x, -y or -z")

    def shift(self, harmonic: int) -> int:
        """d = h r mod N of a harmonic h: its phase from sector to sector is 2π d / N."""
        return (harmonic * self.engine_order) % self.sectors

    def diameters(self, harmonic: int) -> int:
        """Nodal diameters of a harmonic, below zero where they travel from the next sector on."""
        shift = self.shift(harmonic)
        return shift if 2 * shift <= self.sectors else shift - self.sectors

    def phase(self, shift: int) -> complex:
        """exp(-iθ) of the next sector: real where all move as one, and where each moves against
        the next."""
        if 2 * shift % self.sectors == 0:
            return complex(1.0 if shift % self.sectors == 0 else -1.0)
        return complex(np.exp(-2j * np.pi * shift / self.sectors))

    def turned(self, direction: str) -> dict[str, float]:
        """What a displacement of the next sector is made of along the axes that it has."""
        if self.axis is None or direction.removeprefix("r") not in tuple(AXES):
            return {direction: 1.0}
        rotation = direction.removesuffix(direction[-1])
        row = _rotation(self.axis, 2.0 * np.pi / self.sectors)[AXES.index(direction[-1])]
        parts = zip(AXES, row.tolist(), strict=True)
        return {f"{rotation}{axis}": part for axis, part in parts if abs(part) > ACROSS}


@dataclass(frozen=True)
class CyclicSector:
    """A sector whose joints, springs and faces may lead to the next one.

    ``model`` has the unknowns ``(m,)`` of the sector and those that it shares with the next, named
    ``next ...`` or tied: ``own`` and ``following`` ``(m, n)``, O and F, make all of them of the
    sector's own ``(n,)``, which are called ``names``. ``damping_ratio`` is that of its modes, at
    each number of nodal diameters from the lowest on.
    """

    model: DynamicModel
    own: Array
    following: Array
    names: tuple[str, ...]
    ring: Ring
    damping_ratio: float | Array = 0.0

    def at(self, shift: int) -> DynamicModel:
        """The matrices ``(n, n)`` and joints of the sector in a wave of this phase.

        That of :meth:`Ring.shift`; real for 0 and N/2.
        """
        turn, model = self._turn(shift), self.model
        back = turn.conj().T
        mass, damping, stiffness = (
            back @ part @ turn for part in (model.mass, model.damping, model.stiffness)
        )
        damping = damping + modal_damping(mass, stiffness, self.damping_ratio)
        structural = None if model.structural is None else back @ model.structural @ turn
        connection = model.connection @ turn
        return DynamicModel(mass, damping, stiffness, connection, self.names, structural)

    def force(self, force: Array, shift: int) -> ComplexArray:
        """Forces ``(n,)`` on its own unknowns by those ``(m,)`` on all, in a wave of this phase."""
        return np.asarray(force @ self._turn(shift).conj())

    def _turn(self, shift: int) -> ComplexArray:
        """T_d ``(m, n)``, real where it can be."""
        phase = self.ring.phase(shift)
        return np.asarray(self.own + self.following * (phase if phase.imag else phase.real))

    def whole(self) -> DynamicModel:
        """All sectors of the ring, one after the other ``(N n,)``: real, and to compare with."""
        shifts = range(self.ring.sectors)
        turns = [
            np.kron(row, self.own) + np.kron(np.roll(row, 1), self.following)
            for row in np.eye(self.ring.sectors)
        ]
        model = self.model
        mass, damping, stiffness = (
            sum(turn.T @ part @ turn for turn in turns)
            for part in (model.mass, model.damping, model.stiffness)
        )
        undamped = replace(model, damping=np.zeros_like(model.damping))
        at = [replace(self, model=undamped).at(shift).damping for shift in shifts]
        for sector in shifts:
            # Of the next sectors by the waves of all numbers of nodal diameters.
            phases = [self.ring.phase(shift * sector) for shift in shifts]
            block = sum(p * part for p, part in zip(phases, at, strict=True)).real
            at_next = np.roll(np.eye(self.ring.sectors), sector, axis=0)
            damping = damping + np.kron(at_next, block) / self.ring.sectors
        lossy = model.structural
        structural = None if lossy is None else sum(turn.T @ lossy @ turn for turn in turns)
        return DynamicModel(
            np.asarray(mass),
            np.asarray(damping),
            np.asarray(stiffness),
            np.vstack([model.connection @ turn for turn in turns]),
            tuple(f"{name} of {sector}" for sector in shifts for name in self.names),
            None if structural is None else np.asarray(structural),
        )


def stiffened(model: DynamicModel, tangents: Array) -> DynamicModel:
    """A model with springs ``(j, d, d)`` [N/mm] beside its joints."""
    connection = model.connection
    by_joint = connection.reshape(*tangents.shape[:2], -1)
    springs = (tangents @ by_joint).reshape(connection.shape)
    return replace(model, stiffness=model.stiffness + connection.conj().T @ springs)


def lumped_sector(
    masses: Mapping[str, float],
    springs: Mapping[Link, float],
    joints: Sequence[Sequence[Link]],
    ring: Ring,
    damping_ratio: float | Array = 0.0,
) -> CyclicSector:
    """Masses [t] and springs [N/mm] of a sector, along one line or around the ring, with joints.

    Points of the next sector are ``next ...``, as in ``Link("a", "next a")``. Otherwise as
    :func:`fe_models.dynamics.lumped_rig`.

    Examples
    --------
    Masses of 1 kg on springs of 1 N/µm, each joined to the next by another of that stiffness: with
    d nodal diameters ω² = (k + 4 k sin²(π d/N)) / m

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
    """A reduced body that is one sector, with masses [t], springs [N/mm] and joints.

    ``names`` ``(c,)`` are those of its kept displacements, the cut faces among them; points of the
    next sector are ``next ...``. Otherwise as :func:`fe_models.dynamics.reduced_rig`. Raises
    :class:`RigError` for ties of names that there are not, and as that.

    Examples
    --------
    A rod between two masses, of which the second is the first of the next sector: with one nodal
    diameter in four sectors a mass m has ω² = 4 k/m sin²(π/4)

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
    """A sector of matrices of displacements ``names`` and ``modes``, and of what is added."""
    present = (*names, *modes, *(name for name in masses if name not in names))
    own = tuple(name for name in present if name not in ring.ties)
    _check_ties(ring.ties, present, own)
    free = (name for name in own if name not in modes)
    shared = {f"{NEXT}{name}": made for name in free if (made := _made_of(ring, name, own))}
    tied = {name: _made_of(ring, to, own) for name, to in ring.ties.items()}
    if not all(tied.values()):
        raise RigError(
            f"points tied to the next sector, turned about {ring.axis}, do not move in all "
            "directions: keep them all"
        )
    every = (*present, *shared)
    model = undamped_rig(mass, stiffness, every, masses, springs, joints)
    if damping is not None:
        model = replace(model, damping=np.pad(damping, (0, len(every) - len(damping))))
    at_own, at_next = (np.zeros((len(every), len(own))) for _ in range(2))
    for place, name in enumerate(own):
        at_own[every.index(name), place] = 1.0
    for name, made in (shared | tied).items():
        for of, part in made.items():
            at_next[every.index(name), own.index(of)] += part
    return CyclicSector(model, at_own, at_next, own, ring, damping_ratio)


def _check_ties(ties: Mapping[str, str], present: Sequence[str], own: Sequence[str]) -> None:
    for name, to in ties.items():
        if name not in present or to not in own:
            wrong = name if name not in present else to
            raise RigError(f"tied to the next sector: {wrong}: give one of the sector's, once")


def _made_of(ring: Ring, name: str, own: Sequence[str]) -> dict[str, float]:
    """What a displacement of the next sector is made of, by its names; empty if some are none."""
    point, _, direction = name.rpartition(" ")
    if not point:
        return {name: 1.0}
    made = {f"{point} {axis}": part for axis, part in ring.turned(direction).items()}
    return made if all(part in own for part in made) else {}


def _rotation(axis: str, angle: float) -> Array:
    """About an axis, by the right hand: columns are where x, y and z are turned to."""
    about = AXES.index(axis[-1])
    first, second = (about + 1) % 3, (about + 2) % 3
    signed = -angle if axis.startswith("-") else angle
    turned = np.eye(3)
    turned[[first, second], [first, second]] = np.cos(signed)
    turned[second, first], turned[first, second] = np.sin(signed), -np.sin(signed)
    return turned
