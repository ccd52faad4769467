"""Loads of contact faces that are known, such as those of another finite element code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.load_history import LoadHistory
from sa_solver.ties import first_largest
from sa_solver.types import Array
from wear.contact.face_loads import CycleLoads
from workflow.models.checks.loads import check_history, check_slip
from workflow.models.loads import ContactFace, UncoupledSource, UserFace

# Kinds of a face and of its loads.
PAIR = ContactFace, CycleLoads | LoadHistory


@dataclass(frozen=True)
class GivenLoads(UncoupledSource):
    """Loads of contact faces over a closed cycle that are known and that wear does not change.

    Without slips of the nodes, ``method`` "full" of the contact finds them.

    Parameters
    ----------
    pairs : sequence of (ContactFace, CycleLoads or LoadHistory)
        Each face with its loads: resultants with the slips of its nodes, or resultants alone. All
        have the same number of increments.
    user_nodes : sequence of sequence of UserFace
        For each face, nodes of the user's mesh that receive its worn surface.

    Examples
    --------
    A cylinder of 10 mm under 50 N/mm, sheared by ± 20 N/mm with µ = 0.6, of which only the forces
    are known, sticks in the middle and wears beside it:

    >>> import numpy as np
    >>> import fretscale
    >>> from sa_solver import LoadHistory, Material
    >>> from wear import EnergyLaw
    >>> gap = lambda x, y: x**2 / 20.0
    >>> pad = fretscale.ContactFace.nominal("pad", (0.8, 1.0), gap, line=True)
    >>> zero = np.zeros(2)
    >>> forces = LoadHistory([50.0, 50.0], [20.0, -20.0], *[zero] * 6, sliding=zero > 0.0)
    >>> titanium, law = Material(115e3, 0.29), EnergyLaw(1e-8)
    >>> contact = fretscale.Contact((64, 1), (titanium,) * 2, (law, law), 0.6, method="full")
    >>> loads = fretscale.GivenLoads([(pad, forces)])
    >>> worn = fretscale.WearModel(loads, contact, fretscale.Wear(cycles=1e3)).run()["pad"]
    >>> depth = worn["depth_2"].isel(cycles=-1).squeeze()
    >>> print(bool(depth[25] > 1e-8), bool(depth[32] > 1e-8))
    True False
    """

    pairs: Sequence[tuple[ContactFace, CycleLoads | LoadHistory]]
    user_nodes: Sequence[Sequence[UserFace]] = ()

    def __post_init__(self) -> None:
        checks.members(self, pairs=list | tuple, user_nodes=list | tuple)
        if len(self.user_nodes) not in (0, len(self.pairs)):
            raise InputError(
                f"GivenLoads.user_nodes has {len(self.user_nodes)} entries for {len(self.pairs)} "
                "faces: give one for each, or none"
            )
        for pair in self.pairs:
            if len(pair) != len(PAIR) or not all(map(isinstance, pair, PAIR)):
                raise InputError(
                    f"GivenLoads.pairs has {checks.shown(pair)}: give a ContactFace with its "
                    "CycleLoads or LoadHistory"
                )
        names = [face.face.name for face, _ in self.pairs]
        lengths = {len(_history(loads)) for _, loads in self.pairs}
        if not names or len(set(names)) < len(names):
            raise InputError(f"faces are called {names}: give one or more, each by its own name")
        if len(lengths) > 1 or 0 in lengths:
            raise InputError(
                f"loads of faces have {sorted(lengths)} increments: give equally many, at least 1"
            )
        if len({face.face.line for face, _ in self.pairs}) > 1:
            raise InputError("some faces are line contacts, others are not: give one kind")
        for face, loads in self.pairs:
            history, name = _history(loads), face.face.name
            check_history(name, history)
            if isinstance(loads, CycleLoads):
                check_slip(name, loads.slip, history, len(face.face))

    @cached_property
    def faces(self) -> tuple[ContactFace, ...]:
        return tuple(face for face, _ in self.pairs)

    @property
    def line(self) -> bool:  # type: ignore[override]
        """True if the contacts are line contacts."""
        return self.faces[0].face.line

    @property
    def slip_known(self) -> bool:  # type: ignore[override]
        """True if the loads of a face include the slips of its nodes."""
        return any(isinstance(loads, CycleLoads) for _, loads in self.pairs)

    @property
    def without_slip(self) -> list[str]:
        """Names of the faces whose loads do not include the slips of their nodes."""
        return [face.face.name for face, loads in self.pairs if not isinstance(loads, CycleLoads)]

    @cached_property
    def peak(self) -> int:  # type: ignore[override]
        """First increment in which a face carries the largest P of all faces."""
        return first_largest(np.max([cycle.loads.P for cycle in self.unworn()], axis=0))

    def unworn(self) -> tuple[CycleLoads, ...]:
        return self._cycles

    @cached_property
    def _cycles(self) -> tuple[CycleLoads, ...]:
        return tuple(
            loads if isinstance(loads, CycleLoads) else CycleLoads(loads, no_slip(face, loads))
            for face, loads in self.pairs
        )

    def user_faces(self, number: int) -> tuple[UserFace, ...]:
        return tuple(self.user_nodes[number]) if self.user_nodes else ()


def _history(loads: CycleLoads | LoadHistory) -> LoadHistory:
    """Return the resultants of a face."""
    return loads.loads if isinstance(loads, CycleLoads) else loads


def no_slip(face: ContactFace, loads: LoadHistory) -> Array:
    """Return slips of 0 of the nodes of a face ``(t, 2, n)``, for loads that know none."""
    return np.zeros((len(loads), 2, len(face.face)))
