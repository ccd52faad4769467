"""Results of a run of specimens."""

from __future__ import annotations

from dataclasses import dataclass

from fe_models.joints.reduced_contact import VirginCurve
from sa_solver.types import Array
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.half_space import BulkCompliance, HalfSpaceState, PadHalfSpace
from workflow.models.specimens.reduced import ReducedSpecimens
from workflow.models.specimens.wear import BlockState


@dataclass(frozen=True)
class SpecimensState:
    """A worn state with its ``curve`` of first loading."""

    block: BlockState
    curve: VirginCurve


@dataclass(frozen=True)
class MarchedCycle:
    """The coupled cycle on the unworn shape, compared with the uncoupled one.

    ``displacement`` of body 2's ring [mm] and ``force`` that moves it [N] are ``(k,)`` over the
    closed cycle. ``energy`` [N mm] and ``secant_stiffness`` [N/mm] at a small first motion are for
    the coupled and the uncoupled cycle. ``pressure_change`` is the largest change of a node's
    pressure in the cycle over the largest pressure.
    """

    displacement: Array
    force: Array
    energy: tuple[float, float]
    secant_stiffness: tuple[float, float]
    pressure_change: float


@dataclass(frozen=True)
class LoadOutcome:
    """All results under one normal ``force`` [N].

    ``blocks`` are all states, ``kept`` those with fields; ``half_space`` belongs to the first and
    last of them.
    """

    force: float
    blocks: tuple[BlockState, ...]
    kept: tuple[SpecimensState, ...]
    half_space: tuple[HalfSpaceState, HalfSpaceState]
    marched: MarchedCycle


@dataclass(frozen=True)
class SpecimensOutcome:
    """All results of a run of specimens."""

    case: SpecimensCase
    model: ReducedSpecimens
    half_space: PadHalfSpace
    bulk: BulkCompliance
    loads: tuple[LoadOutcome, ...]
