"""Joints of several laws in one structure.

All joints of a structure have the same number of directions. Where some are contacts, laws along
one direction use the first of three, and have no force along the other two.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.types import Array
from wear.joints.bouc_wen import BoucWen
from wear.joints.elastic import ElasticLaw
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.law import JointResponse, JointState
from wear.joints.masing import MasingLaw
from wear.joints.parameters import JointError
from wear.joints.periodic.linearised import LinearisedMarch, Maps
from wear.joints.periodic.march import PeriodicMarch, SettledCycle, driven_by


@dataclass(frozen=True)
class JointGroup:
    """A number of ``joints`` with one ``law``.

    Examples
    --------
    >>> from wear.joints import Jenkins, JointGroup
    >>> JointGroup(Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0), joints=4).joints
    4
    """

    law: Jenkins | BoucWen | MasingLaw | FrictionContact | ElasticLaw
    joints: int

    def __post_init__(self) -> None:
        if checks.whole("joints of a group", self.joints, JointError) < 1:
            raise JointError(f"a group of {self.joints} joints: give 1 or more")


@dataclass(frozen=True)
class MixedLaw:
    """The laws of all ``groups`` of joints, one group after the other.

    Examples
    --------
    A slider, and a contact that is pressed by 10 N and has not moved:

    >>> import numpy as np
    >>> from wear.joints import FrictionContact, Jenkins, JointGroup, MixedLaw
    >>> slider = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> contact = FrictionContact(1e3, 2e3, friction=0.5, normal_load=10.0)
    >>> law = MixedLaw((JointGroup(slider, 1), JointGroup(contact, 1)))
    >>> moved = np.array([[0.002, 0.0, 0.0], [0.002, 0.0, 0.001]])
    >>> print(law.respond(law.rest(2), moved).force)
    [[ 2.  0.  0.]
     [ 2.  0. 12.]]
    """

    groups: tuple[JointGroup, ...]

    def __post_init__(self) -> None:
        if not self.groups or not all(isinstance(group, JointGroup) for group in self.groups):
            raise JointError(f"groups are {self.groups!r}: give one JointGroup or more")
        checks.settle(self, groups=tuple(self.groups))

    @property
    def directions(self) -> int:
        """Largest number of directions of any group."""
        return max(group.law.directions for group in self.groups)

    def rest(self, joints: int) -> JointState:
        """Return the state of all joints before they have moved.

        Rows of laws with fewer columns are padded with zeros. Raise :class:`JointError` for another
        number of joints than the groups have.
        """
        self._require(joints)
        return _stacked([group.law.rest(group.joints) for group in self.groups])

    def respond(self, state: JointState, increment: Array) -> JointResponse:
        """Return the response, as :meth:`wear.joints.law.JointLaw.respond`."""
        state = checks.array("states", state, (None, None), error=JointError, finite=False)
        self._require(len(state))
        count, d = len(state), self.directions
        increment = checks.array(
            "increments", increment, (count, d), error=JointError, finite=False
        )
        force, tangent, lost = np.zeros((count, d)), np.zeros((count, d, d)), np.zeros(count)
        states = []
        for group, rows in self.rows():
            own = slice(group.law.directions)
            part = group.law.respond(state[rows], increment[rows, own])
            force[rows, own], tangent[rows, own, own] = part.force, part.tangent
            lost[rows] = part.dissipated
            states.append(part.state)
        return JointResponse(force, tangent, _stacked(states), lost)

    def march(self, threads: int = 1) -> MixedMarch:
        """Return the march over whole periods, with ``threads`` shares of a group at once."""
        return MixedMarch(self, tuple(PeriodicMarch(g.law, threads) for g in self.groups))

    def rows(self) -> Iterator[tuple[JointGroup, slice]]:
        """Yield the groups and the rows of their joints."""
        end = 0
        for group in self.groups:
            begin, end = end, end + group.joints
            yield group, slice(begin, end)

    def _require(self, joints: int) -> None:
        known = sum(group.joints for group in self.groups)
        if joints != known:
            raise JointError(f"{joints} joints are given for groups of {known}: give as many")


@dataclass(frozen=True)
class MixedMarch:
    """Joints of a mixed ``law`` over whole periods, group by group (:class:`PeriodicMarch`).

    Examples
    --------
    Two sliders with laws of their own, driven as 0.01 cos θ, dissipate the
    energies of the closed form:

    >>> import numpy as np
    >>> from wear.joints import Jenkins, JointGroup, MixedLaw
    >>> laws = [Jenkins(1e4, 0.5, load) for load in (100.0, 60.0)]
    >>> time = 2.0 * np.pi * np.arange(64) / 64
    >>> basis = np.stack([np.cos(time), np.sin(time)], axis=1)
    >>> march = MixedLaw(tuple(JointGroup(law, 1) for law in laws)).march()
    >>> cycle = march.settle(np.array([[[0.01], [0.0]]] * 2), basis, basis.T / 32)
    >>> print(cycle.dissipated.round(6), [float(law.loop_energy(0.01)) for law in laws])
    [1.   0.84] [1.0, 0.84]
    """

    law: MixedLaw
    marches: tuple[PeriodicMarch, ...]

    @property
    def directions(self) -> int:
        return self.law.directions

    def settle(
        self, coefficients: Array, basis: Array, weights: Array, lead: Array | None = None
    ) -> SettledCycle:
        """Return the settled period, as :meth:`PeriodicMarch.settle`."""
        coefficients = driven_by(coefficients)
        joints, size, d = coefficients.shape
        parts = list(self._parts(coefficients))
        cycles = [march.settle(own, basis, weights, lead) for march, _, _, own in parts]
        force, samples = np.zeros((joints, size, d)), np.zeros((len(basis), joints, d))
        for cycle, (_, at, along, _) in zip(cycles, parts, strict=True):
            force[at, :, along], samples[:, at, along] = cycle.force, cycle.samples

        def jacobian() -> Array:
            whole = np.zeros((joints, size, d, size, d))
            for cycle, (_, at, along, _) in zip(cycles, parts, strict=True):
                whole[at, :, along, :, along] = cycle.jacobian
            return whole

        return SettledCycle(
            force,
            samples,
            np.concatenate([cycle.states for cycle in cycles], axis=1),
            np.concatenate([cycle.change for cycle in cycles]),
            jacobian,
            lambda: np.concatenate([cycle.dissipated for cycle in cycles]),
        )

    def linearise(
        self, coefficients: Array, basis: Array, lead: Array, memory: int = 0
    ) -> LinearisedMarch:
        """Return the linearised increments, as :meth:`PeriodicMarch.linearise`."""
        coefficients = driven_by(coefficients)
        joints, _, directions = coefficients.shape
        parts = list(self._parts(coefficients))
        marches = [march.linearise(own, basis, lead, memory) for march, _, _, own in parts]
        memory = max(march.kept.shape[2] for march in marches)
        for place, (of_group, _, _, own) in enumerate(parts):
            # Memory of distributed sliders depends on the motion: give them all of the room.
            if isinstance(of_group.law, MasingLaw) and marches[place].kept.shape[2] < memory:
                marches[place] = of_group.linearise(own, basis, lead, memory)
        maps = Maps.room(len(basis), joints, memory, directions)
        maps.kept[:] = np.eye(memory)
        for march, (_, at, along, _) in zip(marches, parts, strict=True):
            known = slice(march.kept.shape[2])
            maps.kept[:, at, known, known] = march.kept
            maps.by_start[:, at, known, along] = march.by_start
            maps.by_end[:, at, known, along] = march.by_end
            maps.pull[at, along, known] = march.pull
            maps.tangent[:, at, along, along] = march.tangent
            maps.regimes[:, at] = march.regimes
            maps.force[:, at, along] = march.force
        remembered = np.concatenate([march.remembered for march in marches])
        return LinearisedMarch(*maps, remembered)

    def _parts(self, coefficients: Array) -> Iterator[tuple[PeriodicMarch, slice, slice, Array]]:
        """Yield each group's march, the rows and directions of its joints, and its coefficients."""
        for march, (_, rows) in zip(self.marches, self.law.rows(), strict=True):
            own = slice(march.directions)
            yield march, rows, own, np.ascontiguousarray(coefficients[rows, :, own])


def _stacked(states: Sequence[JointState]) -> JointState:
    """Return the states of all groups, padded to the width of the widest."""
    widest = max(state.shape[1] for state in states)
    return np.concatenate(
        [np.pad(state, ((0, 0), (0, widest - state.shape[1]))) for state in states]
    )
