"""Two bodies with a common plane of symmetry, condensed in halves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from fe_models.joints.condensation import Condensed, Keep, made_anew
from fe_models.solvers.symmetry import Mirror
from fe_models.supported_body import SupportedBody


class Halves(NamedTuple):
    """Functions that condense the symmetric and the antisymmetric half of body 1 and body 2.

    ``mirror`` is that of the interface displacements.
    """

    mirror: Mirror
    of_1: Sequence[Callable[[], Condensed]]
    of_2: Sequence[Callable[[], Condensed]]


def mirrored_halves(
    body_1: SupportedBody,
    body_2: SupportedBody,
    run_parallel: Callable[..., Sequence[list[Callable[[], Condensed]] | None]],
    done: Callable[[], None] = lambda: None,
    keep: Keep = made_anew,
) -> Halves | None:
    """Return the halves of two bodies that meet node to node, or None without a common mirror.

    ``run_parallel`` runs jobs; for ``done`` and ``keep`` see :meth:`SupportedBody.halves`.
    """
    for axis in body_1.elastic.body.axes:
        mirrors = body_1.mirror(axis), body_2.mirror(axis)
        if mirrors[0] is None or mirrors[1] is None:
            continue
        on_1 = body_1.on_interface(mirrors[0])
        if on_1 is None or on_1 != body_2.on_interface(mirrors[1]):
            continue
        of_1, of_2 = run_parallel(
            partial(body_1.halves, mirrors[0], on_1, done, keep),
            partial(body_2.halves, mirrors[1], on_1, done, keep),
        )
        if of_1 is not None and of_2 is not None:
            return Halves(on_1, of_1, of_2)
    return None
