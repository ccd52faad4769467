"""Joints driven through a given period until their forces repeat, and these forces' derivative.

The displacement of a joint is a combination of functions of time, sampled over one period: u = Φ c
with the basis Φ ``(t, m)`` and coefficients c ``(m, d)``. The joint is driven along straight paths
from sample to sample, period after period, until its state is the same after one as before. Its
forces are then projected, F = W f with the weights W ``(m, t)``, and so is their exact derivative
with respect to c, which passes through everything the joint remembers: where its slider is, where
it turned round, when it touched. The caller chooses the functions.

A joint is driven into the period from rest, through the points Φ_lead c: the rows ``lead``
``(p, m)``, of which the last is the first sample. This decides between the many periodic forces of
a joint that does not slip fully; where it does, it makes no difference.

Derivatives are those of the forces on these paths, so that a Newton iteration on the coefficients
converges as fast as it can. On a switch between two states they are those of one side.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from sa_solver import checks
from sa_solver.types import Array
from wear.joints.bouc_wen import BoucWen
from wear.joints.elastic import ElasticLaw, settle_elastic
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.masing import MasingLaw
from wear.joints.parameters import JointError
from wear.joints.periodic.contact import (
    differentiate_contacts,
    energies_of_contacts,
    settle_contacts,
)
from wear.joints.periodic.linearised import (
    LinearisedMarch,
    Maps,
    linearise_contacts,
    linearise_curves,
    linearise_elastic,
    linearise_sliders,
)
from wear.joints.periodic.sliders import (
    BOUC_WEN,
    JENKINS,
    DrivenJoints,
    Period,
    differentiate_sliders,
    settle_curves,
    settle_sliders,
)

STICK, SLIP, SEPARATED = 0, 1, 2
"""States of a joint at a sample. A spread or smooth joint slips where less than half of the
stiffness that it may lose is left."""

SettlingKernel = Callable[[Period, DrivenJoints], None]
# Numbers that joints of so many directions remember, and the march that says what becomes of them.
MEMORY = {1: (1, linearise_sliders), 3: (2, linearise_contacts)}


class Kernels(NamedTuple):
    """Compiled marches of a law: until it repeats, for derivatives and energies, None where these
    come with the first."""

    settle: SettlingKernel
    differentiate: SettlingKernel | None
    dissipate: SettlingKernel | None


@dataclass(frozen=True)
class SettledCycle:
    """What ``j`` joints of ``d`` directions do in a period of ``t`` samples that repeats.

    ``force`` ``(j, m, d)`` is W f [N], ``jacobian`` ``(j, m, d, m, d)`` its derivative with respect
    to the coefficients; ``samples`` ``(t, j, d)`` [N] are the forces, ``states`` ``(t, j)`` one of
    ``STICK``, ``SLIP`` and ``SEPARATED`` each, ``dissipated`` ``(j,)`` [N mm] is lost per period.
    ``change`` ``(j,)`` is by how much the force at the first sample still differed after the last
    period, over the largest force.

    What is dear is found when it is asked for: ``differentiate`` and ``dissipate`` tell the
    derivative and the energies.
    """

    force: Array
    samples: Array
    states: np.ndarray
    change: Array
    differentiate: Callable[[], Array]
    dissipate: Callable[[], Array]

    @cached_property
    def jacobian(self) -> Array:
        return self.differentiate()

    @cached_property
    def dissipated(self) -> Array:
        return self.dissipate()


def driven_by(coefficients: object) -> Array:
    """Return coefficients ``(j, m, d)`` of joints.

    Raises :class:`JointError`. Iterations may come to ones that are not finite, and find that out
    by themselves.
    """
    shape = (None, None, None)
    return checks.array("coefficients", coefficients, shape, error=JointError, finite=False)


def _sampled(functions: object) -> Array:
    """Return functions of time at samples, or the weights of these. Raises :class:`JointError`.

    An iteration gives the same ones each time: whether they are finite its forces tell.
    """
    shape = (None, None)
    return checks.array(
        "functions at samples", functions, shape, error=JointError, finite=False, order="K"
    )


@dataclass(frozen=True)
class PeriodicMarch:
    """A joint ``law`` over whole periods.

    ``threads`` march that many shares of the joints at once.

    Examples
    --------
    A joint driven as 0.01 cos θ has the energy of the closed form, and its harmonics but for the 64
    samples:

    >>> import numpy as np
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> law = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> time = 2.0 * np.pi * np.arange(64) / 64
    >>> basis = np.stack([np.cos(time), np.sin(time)], axis=1)
    >>> cycle = PeriodicMarch(law).settle(np.array([[[0.01], [0.0]]]), basis, basis.T / 32)
    >>> print(f"{cycle.dissipated[0]:.6f} N mm of {law.loop_energy(0.01):.6f}")
    1.000000 N mm of 1.000000
    >>> print(cycle.force.ravel().round(2), "of", np.round(law.first_harmonic(0.01), 2))
    [ 50.   -31.88] of [ 50.   -31.83]
    """

    law: Jenkins | BoucWen | MasingLaw | FrictionContact | ElasticLaw
    threads: int = 1

    def __post_init__(self) -> None:
        checks.whole("threads", self.threads, JointError)

    @property
    def directions(self) -> int:
        return self.law.directions

    def settle(
        self, coefficients: Array, basis: Array, weights: Array, lead: Array | None = None
    ) -> SettledCycle:
        """The settled period of joints with the ``coefficients`` ``(j, m, d)`` [mm].

        ``basis`` ``(t, m)``, ``weights`` ``(m, t)`` and ``lead`` ``(p, m)`` as in the module;
        without ``lead`` joints are driven from rest straight to the first sample. Raises
        :class:`JointError` for shapes that do not fit.
        """
        coefficients, basis, weights = driven_by(coefficients), *map(_sampled, (basis, weights))
        lead = basis[:1] if lead is None else _sampled(lead)
        self._require(coefficients, basis, weights, lead)
        joints, size, directions = coefficients.shape
        kernels = self._kernels[0]
        driven = self._driven(coefficients, basis, lead, size)
        period = Period.of(basis, weights, lead)

        def written(by: SettlingKernel | None, result: Array) -> Array:
            if by is not None:
                self._march(by, period, driven)
            return result

        self._march(kernels.settle, period, driven)
        samples = driven.force.reshape(joints, len(basis), directions)
        slopes = driven.jacobian.reshape(joints, size, directions, size, directions)
        return SettledCycle(
            weights @ samples,
            samples.transpose(1, 0, 2),
            driven.states.T,
            driven.change,
            partial(written, kernels.differentiate, slopes),
            partial(written, kernels.dissipate, driven.dissipated),
        )

    def linearise(
        self, coefficients: Array, basis: Array, lead: Array, memory: int = 0
    ) -> LinearisedMarch:
        """What small deviations from the settled period do, increment by increment.

        Arguments as those of :meth:`settle`; the times of ``basis``, which ascend from the
        beginning of the period, need not be equally far apart. Joints of spread sliders have room
        for at least ``memory`` numbers, so that motions with fewer turning points are like others.
        """
        coefficients, basis, lead = driven_by(coefficients), _sampled(basis), _sampled(lead)
        joints, _, directions = coefficients.shape
        self._require(coefficients, basis, basis.T, lead)
        driven = self._driven(coefficients, basis, lead, 0)
        law, samples = self.law, len(basis)
        if isinstance(law, MasingLaw):
            nothing = Maps.room(samples, joints, 1, 1)
            needed = 1 + 2 * linearise_curves(len(lead), driven, nothing)
            maps = Maps.room(samples, joints, max(needed, memory), 1)
            linearise_curves(len(lead), driven, maps)
            return LinearisedMarch.of(maps)
        remembered, linearise = MEMORY[directions]
        if isinstance(law, ElasticLaw):
            remembered, linearise = 0, linearise_elastic
        else:
            self._kernels[0].settle(Period.of(basis, basis.T, lead), driven)
        maps = Maps.room(samples, joints, remembered, directions)
        linearise(driven, maps)
        return LinearisedMarch.of(maps)

    def _driven(
        self, coefficients: Array, basis: Array, lead: Array, functions: int
    ) -> DrivenJoints:
        """Joints to be marched, with room for derivatives by so many functions of time."""
        joints, _, directions = coefficients.shape
        parameters = self._kernels[1]
        if len(parameters) < joints:
            parameters = np.repeat(parameters, joints, axis=0)
        points, of_points = (joints, len(basis)), () if directions == 1 else (directions,)
        path = (basis @ coefficients).reshape(points + of_points)
        before = (lead @ coefficients).reshape(joints, len(lead), *of_points)
        return DrivenJoints(
            parameters,
            path,
            before,
            np.empty(path.shape),
            np.empty(points, np.int8),
            np.empty((joints, functions, *of_points, functions, *of_points)),
            np.empty(joints),
            np.empty(joints),
            np.empty((joints, 4)),
        )

    @cached_property
    def _kernels(self) -> tuple[Kernels, Array]:
        """The compiled marches of the law, and its parameters ``(1 or j, p)``."""
        law = self.law
        if isinstance(law, FrictionContact):
            contacts = Kernels(settle_contacts, differentiate_contacts, energies_of_contacts)
            return contacts, law.parameters
        if isinstance(law, MasingLaw):
            return Kernels(settle_curves, None, None), law.parameters
        if isinstance(law, ElasticLaw):
            return Kernels(settle_elastic, None, None), law.parameters
        sliders = Kernels(settle_sliders, differentiate_sliders, None)
        if isinstance(law, Jenkins):
            return sliders, np.insert(law.parameters, 0, JENKINS, axis=1)
        parameters = np.insert(law.parameters, 0, BOUC_WEN, axis=1)
        # Of its stiffness the spring has what is not residual.
        parameters[:, 1] -= parameters[:, 2]
        return sliders, parameters

    def _march(self, kernel: SettlingKernel, period: Period, driven: DrivenJoints) -> None:
        """March all joints, in a share per thread."""
        joints = len(driven.change)
        shares = min(self.threads, joints)
        if shares <= 1:
            kernel(period, driven)
            return
        ends = [joints * share // shares for share in range(shares + 1)]

        def march(share: slice) -> None:
            kernel(period, DrivenJoints(*(part[share] for part in driven)))

        with ThreadPoolExecutor(shares) as pool:
            list(pool.map(march, map(slice, ends[:-1], ends[1:])))

    def _require(self, coefficients: Array, basis: Array, weights: Array, lead: Array) -> None:
        joints, size, directions = coefficients.shape
        if directions != self.directions:
            raise JointError(
                f"coefficients of {directions} directions for joints of {self.directions}"
            )
        if basis.shape[1] != size or weights.shape != basis.T.shape or lead.shape[1] != size:
            raise JointError(
                f"{size} coefficients with a basis {basis.shape}, weights {weights.shape} and "
                f"lead {lead.shape}: they must be (t, {size}), ({size}, t) and (p, {size})"
            )
        laws = len(self._kernels[1])
        if laws not in (1, joints):
            raise JointError(f"the law is that of {laws} joints, the coefficients of {joints}")
