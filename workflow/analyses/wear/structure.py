"""A kind of structure that loads contacts, with the functions that the wear analysis needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from fe_models.solvers.memory import full_matrices_bytes
from workflow.analyses.wear.case.base import FiniteElementCase, WearCase
from workflow.analyses.wear.run_time import Extent
from workflow.messages.warning_kinds import Notice
from workflow.shell.analysis import as_written
from workflow.shell.memory import Memory, factor_bytes

if TYPE_CHECKING:
    from workflow.models.contact import FaceContact
    from workflow.models.wear import Structure

AnyWearCase = TypeVar("AnyWearCase", bound=WearCase)

# Numbers per cell that are held during a contact solve, for spectra and iterates.
SPECTRA = 300


def memory(
    case: WearCase,
    nodes: int = 0,
    interface_nodes: int = 0,
    kept: int = SPECTRA,
    remedy: str = "lower contact.grid",
    bodies: int = 2,
    mirrored: bool = False,
    sparse: bool = False,
) -> Memory:
    """Return the memory of the contacts and of a structure with its joint.

    Parameters
    ----------
    case
        The case.
    nodes, interface_nodes
        Numbers of nodes of all bodies and of all interfaces, 0 while they are unknown.
    kept
        Count of numbers per cell of the grid, by default that of one contact at a time.
    remedy
        How the case can be made smaller.
    bodies
        Number of bodies.
    mirrored
        Whether the bodies have a plane of symmetry, which halves the matrices.
    sparse
        Whether the joint can do without full matrices where they do not fit.
    """
    cells = max(prod(terms.grid) for terms in case.every_terms)
    factors = factor_bytes(nodes)
    matrices = full_matrices_bytes(3 * interface_nodes, bodies, mirrored)
    full = Memory(cells * kept, remedy, factors + matrices)
    return full if full.fits or not sparse else Memory(cells * kept, remedy, factors)


def needs_no_matrices(case: FiniteElementCase, order: int) -> bool:
    """Return whether the joint of bodies of this order of elements can do without full matrices.

    Only a linear structure of first-order elements can (:mod:`fe_models.joints.sparse_joint`), and
    nodes that wear need the matrix.
    """
    return order == 1 and not case.nonlinearity.asked and case.contact.method != "nodes"


@dataclass(frozen=True)
class WearStructure(Generic[AnyWearCase]):
    """A kind of structure: functions of a case that a wear run calls.

    ``case`` is the class of its cases. ``model`` returns the structure of a case, or another source
    of loads. ``extent`` returns the size of its loads, for the time estimate, and ``memory`` the
    memory of a run, given the nodes of both bodies and of all interfaces (0: unknown). ``choose``
    returns the case with its open settings decided, and a record of why. ``warnings`` are about the
    unworn contact of a stage under a peak load [N]. ``settings`` returns the settings that reduce
    parts of the error, where they differ from those of all cases.
    """

    name: str
    case: type[AnyWearCase]
    model: Callable[[AnyWearCase], Structure]
    extent: Callable[[AnyWearCase], Extent]
    memory: Callable[[AnyWearCase, int, int], Memory] = memory
    choose: Callable[[AnyWearCase], tuple[AnyWearCase, dict[str, Any] | None]] = as_written
    warnings: Callable[[AnyWearCase, FaceContact, float], Iterable[Notice]] = lambda *_: ()
    settings: Callable[[AnyWearCase], Mapping[str, str]] = lambda _: {}
