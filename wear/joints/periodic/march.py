"""Joints driven through a given period until their forces repeat, and the forces' derivative.

The displacement of a joint is a combination of functions of time, sampled over one period: u = Φ c
with the basis Φ ``(t, m)`` and coefficients c ``(m, d)``. The joint is driven along straight paths
from sample to sample, period after period, until its state at the end of a period is that at its
beginning. Its forces are then projected, F = W f with the weights W ``(m, t)``, and so is their
exact derivative with respect to c. The derivative includes all of the joint's memory: where its
slider is, where it turned, when it touched. The caller chooses the functions.

A joint is driven into the period from rest, through the points Φ_lead c with the rows ``lead``
``(p, m)``, the last of which is the first sample. This selects one of the many periodic forces that
a joint without full slip may have; with full slip it has no effect.

Derivatives are those of the forces on these paths, so that a Newton iteration on the coefficients
converges as fast as it can. At a transition between two states they are those of one side.
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
from wear.joints.compiled import call_in_turn
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
"""States of a joint at a sample. A joint of distributed sliders or of Bouc and Wen slips where less
than half of the stiffness that it can lose is left.
"""

SettlingKernel = Callable[[Period, DrivenJoints], None]
# Size of the memory of joints by their number of directions, and their linearised march.
MEMORY = {1: (1, linearise_sliders), 3: (2, linearise_contacts)}


class Kernels(NamedTuple):
    """Compiled marches of a law.

    ``settle`` marches until the forces repeat. ``differentiate`` and ``dissipate`` write
    derivatives and energies, and are None where ``settle`` writes them.
    """

    settle: SettlingKernel
    differentiate: SettlingKernel | None
    dissipate: SettlingKernel | None


@dataclass(frozen=True)
class SettledCycle:
    """Periodic forces of ``j`` joints of ``d`` directions in a period of ``t`` samples.

    The derivative and the energies are expensive, and computed when they are first used.

    Parameters
    ----------
    force
        W f ``(j, m, d)`` [N].
    samples
        Forces at the samples ``(t, j, d)`` [N].
    states
        ``STICK``, ``SLIP`` or ``SEPARATED`` ``(t, j)``.
    change
        Change of the force at the first sample in the last period, over the largest force ``(j,)``.
    differentiate
        Function that returns the derivative of ``force`` with respect to the coefficients
        ``(j, m, d, m, d)``.
    dissipate
        Function that returns the energy lost per period ``(j,)`` [N mm].
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
    """March of the joints of one ``law`` over whole periods.

    ``threads`` is the number of shares of the joints that are marched in parallel.

    Examples
    --------
    A joint driven as 0.01 cos θ has the energy of the closed form, and its
    harmonics within the error of 64 samples:

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
        """Return the settled period of joints.

        Parameters
        ----------
        coefficients
            Coefficients c of the joints ``(j, m, d)`` [mm].
        basis
            Functions of time Φ at the samples ``(t, m)``.
        weights
            Weights W of the projection ``(m, t)``.
        lead
            Functions of time at the points on the way from rest ``(p, m)``. Without them joints are
            driven straight to the first sample.

        Raises
        ------
        JointError
            If the shapes do not fit.
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
        """Return the linearised increments of the settled period.

        Parameters
        ----------
        coefficients, basis, lead
            As in :meth:`settle`. The times of ``basis`` ascend from the beginning of the period and
            need not be evenly spaced.
        memory
            Least size of the memory of joints of distributed sliders, so that motions with fewer
            turning points have arrays of the same shape.
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
            self._march(self._kernels[0].settle, Period.of(basis, basis.T, lead), driven)
        maps = Maps.room(samples, joints, remembered, directions)
        linearise(driven, maps)
        return LinearisedMarch.of(maps)

    def _driven(
        self, coefficients: Array, basis: Array, lead: Array, functions: int
    ) -> DrivenJoints:
        """Return joints to be marched, with room for derivatives by ``functions`` functions."""
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
        """Compiled marches of the law, and its parameters ``(1 or j, p)``."""
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
        # The spring has the stiffness less the residual one.
        parameters[:, 1] -= parameters[:, 2]
        return sliders, parameters

    def _march(self, kernel: SettlingKernel, period: Period, driven: DrivenJoints) -> None:
        """March all joints, one share of them per thread."""
        joints = len(driven.change)
        shares = min(self.threads, joints)
        if shares <= 1:
            call_in_turn(kernel, period, driven)
            return
        ends = [joints * share // shares for share in range(shares + 1)]

        def march(share: slice) -> None:
            call_in_turn(kernel, period, DrivenJoints(*(part[share] for part in driven)))

        with ThreadPoolExecutor(shares) as pool:
            list(pool.map(march, map(slice, ends[:-1], ends[1:])))

    def _require(self, coefficients: Array, basis: Array, weights: Array, lead: Array) -> None:
        joints, size, directions = coefficients.shape
        if joints == 0:
            # The compiled marches read the first joint.
            raise JointError("the coefficients are of no joints: give those of 1 or more")
        if directions != self.directions:
            raise JointError(
                f"the coefficients have {directions} directions, the joints {self.directions}: "
                "give as many"
            )
        if basis.shape[1] != size or weights.shape != basis.T.shape or lead.shape[1] != size:
            raise JointError(
                f"{size} coefficients with a basis {basis.shape}, weights {weights.shape} and "
                f"lead {lead.shape}: they must be (t, {size}), ({size}, t) and (p, {size})"
            )
        laws = len(self._kernels[1])
        if laws not in (1, joints):
            raise JointError(
                f"the law has parameters of {laws} joints, the coefficients are of {joints}: give "
                "as many of both, or numbers as parameters"
            )
