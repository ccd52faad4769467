"""Rigs: vibrating structures with their excitation and observed displacements."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.excitation import CombinedForces, ConstantForce, ExcitationForce
from fe_models.dynamics.ground_motion import Translation
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.motion import Motion
from fe_models.dynamics.periodic.receptance import RIGID
from fe_models.dynamics.rig import natural_frequencies, unit_force
from fe_models.dynamics.rings.sector import CyclicSector
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Indices
from wear.joints.elastic import ElasticLaw
from wear.joints.friction_contact import FrictionContact
from workflow.models.rig.laws import Laws, grouped
from workflow.models.rig.names import MODE

# Most natural frequencies that are reported, from the lowest: enough for any row of masses.
MOST_FREQUENCIES = 20


@dataclass(frozen=True)
class JointEntry:
    """A number of ``joints`` of one entry of a case; loops are along their direction ``along``.

    The joints may be ``contacts``, and may have a law of their ``own``.
    """

    joints: int
    along: int = 0
    contacts: bool = False
    own: bool = False


@dataclass(frozen=True)
class JointNodes:
    """Points, normals and places of the joints of a reduced body.

    ``names`` ``(j,)`` are the names of their points. ``normals`` ``(j, 3)`` point from the opposite
    side into the body. ``places`` ``(j, 3)`` are coordinates [mm], None unless all are known.
    """

    names: tuple[str, ...]
    normals: Array
    places: Array | None

    @property
    def same_normal(self) -> bool:
        """True if all joints have the same normal."""
        return bool((self.normals == self.normals[0]).all())


@dataclass(frozen=True)
class RigModel:
    """A vibrating structure with joints, its driven and its observed places.

    Most rigs are made by :meth:`of`; the other fields describe rigs of a case.

    Parameters
    ----------
    model : DynamicModel
        Matrices of the structure and the connection of its joints; of a ring, those for nodal
        diameter 0.
    driven : array (n,)
        Forces [N] of an excitation of 1 N.
    seen : array (k, n)
        Map from displacements to the observed ones; the last is the main one.
    labels : tuple of str (k,)
        Names of the observed displacements.
    directions : int
        Directions of each joint: 1, or 3 for contacts.
    along : int
        Direction of the joints whose loops are observed.
    entries : tuple of JointEntry
        The joints of a case in order, empty where a case needs none.
    in_a_row : bool
        Whether the structure is a row of masses, which move along x.
    pressing : array (n,), optional
        Forces of a normal load of 1 N on two bodies in contact. Without it the load is the preload
        of the joints.
    stretch : array (n,), optional
        Map from displacements to the relative displacement of loops, in place of the joints' mean.
    places : array (j, 2)
        Places [mm] of the joints on the contact plane of two bodies, empty elsewhere.
    gap, area : array (j,)
        Initial gap [mm] and area [mm²] of the joints of two bodies, empty elsewhere.
    translations : mapping of str to Translation
        Rigid motions with the ground, by direction.
    nodes : JointNodes, optional
        The joints of a reduced body.
    sector : CyclicSector, optional
        One sector of a ring.

    Examples
    --------
    Two masses on springs; the joint is at the second one, and the first one is driven:

    >>> import fretscale
    >>> from fe_models.dynamics import Link, lumped_rig
    >>> springs = {Link("m1"): 1.3e3, Link("m2", "m1"): 270e3}
    >>> row = lumped_rig({"m1": 21e-3, "m2": 1.2e-3}, springs, [[Link("m2")]])
    >>> rig = fretscale.RigModel.of(row, driven={"m1": 1.0}, observed=["m1", "m2"])
    >>> [round(frequency, 1) for frequency in rig.free()]
    [38.5, 2454.6]
    """

    model: DynamicModel
    driven: Array
    seen: Array
    labels: tuple[str, ...]
    directions: int = 1
    along: int = 0
    entries: tuple[JointEntry, ...] = ()
    in_a_row: bool = True
    pressing: Array | None = None
    stretch: Array | None = None
    places: Array = field(default_factory=lambda: np.empty((0, 2)))
    gap: Array = field(default_factory=lambda: np.empty(0))
    area: Array = field(default_factory=lambda: np.empty(0))
    translations: Mapping[str, Translation] = field(default_factory=dict)
    nodes: JointNodes | None = None
    sector: CyclicSector | None = None

    @classmethod
    def of(
        cls,
        model: DynamicModel,
        driven: Mapping[str, float],
        observed: Sequence[str],
        directions: int = 1,
    ) -> RigModel:
        """Return the rig of a model whose displacements have names.

        Parameters
        ----------
        model
            Such as of :func:`fe_models.dynamics.lumped_rig`, or of
            :func:`fe_models.dynamics.reduced_rig`.
        driven
            Forces [N] by the names of their displacements, at an excitation of 1 N.
        observed
            Names of the observed displacements, the main one last.
        directions
            Directions of each joint: 1, or 3 for contacts.
        """
        if not isinstance(model, DynamicModel):
            raise InputError(f"model is {checks.shown(model)}: give a DynamicModel")
        if not isinstance(driven, Mapping) or not driven:
            raise InputError(
                f"driven is {checks.shown(driven)}: give forces by the names of displacements"
            )
        if not isinstance(observed, list | tuple) or not observed:
            raise InputError(
                f"observed is {checks.shown(observed)}: give a list of names, the main one last"
            )
        for name, force in driven.items():
            checks.number(f"the force on {name}", force)
        rows = len(model.connection)
        if checks.whole("directions", directions) not in (1, 3) or rows % directions:
            raise InputError(
                f"directions = {directions} of {rows} rows of joints: give 1, or 3 for contacts"
            )
        forces = np.sum([force * unit_force(model, name) for name, force in driven.items()], axis=0)
        seen = np.array([unit_force(model, name) for name in observed])
        return cls(model, forces, seen, tuple(observed), directions)

    @property
    def linked(self) -> DynamicModel:
        """Model with all points that joints and dashpots may connect, next sector included."""
        return self.model if self.sector is None else self.sector.model

    @property
    def model_at_first_harmonic(self) -> DynamicModel:
        """Model as harmonic 1 of the excitation drives it: a sector at its nodal diameters."""
        if self.sector is None:
            return self.model
        return self.sector.at(self.sector.ring.shift(1))

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.model.connection) // self.directions

    @property
    def shared(self) -> np.ndarray:
        """Mask ``(j,)`` of the joints that have the law of the case."""
        own = np.repeat([entry.own for entry in self.entries], self.counts)
        return np.logical_not(own) if self.entries else np.ones(self.joints, bool)

    @property
    def contacts(self) -> np.ndarray:
        """Mask ``(j,)`` of the joints that are friction contacts."""
        if not self.entries:
            return np.full(self.joints, self.directions > 1)
        return np.repeat([entry.contacts for entry in self.entries], self.counts)

    @property
    def counts(self) -> list[int]:
        """Number of joints of every entry of the case."""
        return [entry.joints for entry in self.entries]

    def of_entry(self, number: int | None) -> tuple[slice, int]:
        """Return the joints of an entry of the case, or all, and their observed direction."""
        if number is None or not self.entries:
            return slice(0, self.joints), self.along
        first = sum(self.counts[:number])
        entry = self.entries[number]
        return slice(first, first + entry.joints), entry.along

    @property
    def retained(self) -> Indices:
        """Indices ``(p,)`` of displacements of places: all but the modes of reduced bodies."""
        modal = [re.fullmatch(MODE, name) is not None for name in self.model.names]
        return np.flatnonzero(np.logical_not(modal))

    @property
    def stretched(self) -> list[str]:
        """Stretch of every direction of every joint ``(j d,)`` as text, such as ``m2 - m1``."""
        return [
            " - ".join(
                "+".join(self.linked.names[place] for place in np.flatnonzero(side)) or "ground"
                for side in ((row > 0.0, row < 0.0) if (row < 0.0).any() else (row > 0.0,))
            )
            for row in self.linked.connection
        ]

    @property
    def still(self) -> Array:
        """Zero displacements of the joints ``(j, d)`` [mm]."""
        return np.zeros((self.joints, self.directions))

    def preload(self, law: Laws) -> Array:
        """Return the static load ``(n,)`` [N] that balances the joints before they move.

        Displacements count from this state. The deformation of the structure by the load before
        does not matter, as the structure is linear.
        """
        force = law.respond(law.rest(self.joints), self.still).force
        return np.asarray(force.ravel() @ self.model.connection)

    def with_preload(self, law: Laws, force: ExcitationForce) -> CombinedForces:
        """Return an excitation with the static load that balances the joints at rest."""
        preload = self.preload(law)
        if not preload.any():
            return CombinedForces((force,))
        return CombinedForces((force, ConstantForce(preload)))

    def loop(self, motion: Motion) -> tuple[Array, Array]:
        """Return mean displacement [mm] and total force [N] ``(t,)`` of joints with the case's law.

        Both are along the direction number ``along``.
        """
        stretch, force, shared = motion.joint_displacement, motion.joint_force, self.shared
        if not shared.any():
            return np.zeros(len(force)), np.zeros(len(force))
        pulled = force[:, shared, self.along].sum(axis=1)
        return stretch[:, shared, self.along].mean(axis=1), pulled

    def by_entry(self, motion: Motion) -> tuple[Array, Array]:
        """Return mean displacement [mm] and total force [N] ``(t, e)`` of each entry of joints."""
        entries = [self.of_entry(number) for number in range(len(self.entries))]
        stretch, force = motion.joint_displacement, motion.joint_force
        return (
            np.stack([stretch[:, rows, along].mean(axis=1) for rows, along in entries], axis=1),
            np.stack([force[:, rows, along].sum(axis=1) for rows, along in entries], axis=1),
        )

    def looked_at(self, values: Array) -> Array:
        """Return the main observed displacement or acceleration ``(t,)`` of all ``(t, n)``."""
        return values @ self.seen[-1]

    def contact(self, motion: Motion) -> dict[str, Any]:
        """Return the normal forces of friction contacts in a motion, empty for other joints."""
        if not self.contacts.any():
            return {}
        normal = motion.joint_force[:, self.contacts, 2]
        total = normal.sum(axis=1)
        return {
            "smallest_normal_force": float(total.min()),
            "largest_normal_force": float(total.max()),
            "most_open": int((normal <= 0.0).sum(axis=1).max()),
        }

    def free(self) -> list[float]:
        """Return the lowest natural frequencies without the joints [Hz]."""
        return _lowest(natural_frequencies(self.model_at_first_harmonic))

    def stuck(self, law: Laws, rest: Array | None = None) -> Array:
        """Return tangents ``(j, d, d)`` [N/mm] of joints that stick.

        Where the load presses them, they are displaced by ``rest`` ``(j, d)`` [mm].
        """
        state, still = law.rest(self.joints), self.still
        if rest is not None:
            state = law.respond(state, rest).state
        return law.respond(state, still).tangent

    def stuck_damping(self, law: Laws, rest: Array | None = None) -> list[float]:
        """Return damping ratios of the lowest modes with all joints stuck.

        The damping matrix C is that of the open joints.
        """
        held, model = sl.block_diag(*self.stuck(law, rest)), self.model_at_first_harmonic
        stiffness = model.stiffness + model.connection.conj().T @ held @ model.connection
        squares, shapes = sl.eigh(stiffness, model.mass)
        # Rigid motions of a free structure have no damping ratio.
        lowest = np.flatnonzero(squares > RIGID * squares[-1])[:MOST_FREQUENCIES]
        angular = np.sqrt(squares[lowest])
        lost = _taken(shapes, model.damping)[lowest]
        if model.structural is not None:
            lost += _taken(shapes, model.structural)[lowest] / angular
        ratios: list[float] = (0.5 * lost / angular).tolist()
        return ratios

    def modes(self, law: Laws, rest: Array | None = None) -> dict[str, list[float]]:
        """Return the lowest natural frequencies with all joints stuck, and with all sliding [Hz].

        Joints that are open at rest stay open; see :meth:`stuck`.
        """
        stuck = self.stuck(law, rest)
        sliding = np.zeros_like(stuck)
        for group, rows in grouped(law, self.joints).rows():
            if isinstance(group.law, FrictionContact):
                sliding[rows, 2, 2] = stuck[rows, 2, 2]
            elif isinstance(group.law, ElasticLaw):
                sliding[rows] = stuck[rows]
            else:
                sliding[rows, 0, 0] = group.law.residual_stiffness
        return {
            "stuck": _lowest(natural_frequencies(self.model_at_first_harmonic, stuck)),
            "sliding": _lowest(natural_frequencies(self.model_at_first_harmonic, sliding)),
        }


def _taken(shapes: Array, damping: Array) -> Array:
    """Return sᴴ C s ``(m,)`` of shapes ``(n, m)``."""
    return np.asarray(np.einsum("nm,nm->m", shapes.conj(), damping @ shapes).real)


def _lowest(frequencies: Array) -> list[float]:
    lowest: list[float] = frequencies[:MOST_FREQUENCIES].tolist()
    return lowest
