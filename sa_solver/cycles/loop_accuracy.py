"""What grid and increments leave of a tangential loop.

Stiffness goes with the root of the area, and that comes in whole cells: a quarter of those at its
rim may be too many or too few. This is a bound; two grids may agree by chance. What is mobilised of
friction, and the energy, are held against a loop of half as many cells and increments. Energy of
partial slip goes with Q³ / kt (Mindlin & Deresiewicz 1953), under an imposed motion with kt²: it is
no better known than that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from sa_solver.contact import FrictionalContact
from sa_solver.cycles.tangential_loop import LoopFailure, LoopPath, TangentialLoop, march_loop
from sa_solver.errors import ContactProblemError
from sa_solver.half_space.nested_grids import GridTransfer
from sa_solver.types import Array, Grid

OFF = 0.25
"""Part of a cell at the rim by which the area may be off: errors of spheres, new and worn flat, 6
to 29 cells in radius, were 0.005 to 0.8 of what this gives, so that it is meant as a bound."""

FEWEST_INCREMENTS = 2
"""Of a branch of any loop."""


@dataclass(frozen=True)
class LoopErrors:
    """Estimated errors of a loop: ``stiffness`` [N/mm], ``friction`` [1], ``energy`` [N mm].

    Per mm on line grids. ``friction`` is that of :attr:`TangentialLoop.friction`: of what is
    mobilised, hardly anything where the contact slides.
    """

    stiffness: float
    friction: float
    energy: float


def loop_errors(
    contact: FrictionalContact, height: Array, path: LoopPath, loop: TangentialLoop
) -> LoopErrors:
    """How far the ``loop`` of :func:`march_loop` may be off, by its rim and one half as fine.

    ``height`` ``(nx, ny)`` [mm] and ``path`` are those of the loop. Cells and increments are
    halved, no fewer than 2 a branch. Friction and energy have errors as large as they are where the
    coarse loop does not converge.

    Examples
    --------
    A sphere in partial slip: its stiffness is within the estimate of Mindlin's 1949 (J. Appl.
    Mech. 16, 259):

    >>> from sa_solver import ElasticPair, FrictionalContact, Grid, HalfSpace, LoopPath, Material
    >>> from sa_solver import march_loop
    >>> from sa_solver.cycles.loop_accuracy import loop_errors
    >>> from sa_solver.reference.mindlin import ShearedSphere
    >>> body = Material(young=115e3, poisson=0.3)
    >>> sphere = ShearedSphere(400.0, 10.0, body, body, 0.7)
    >>> grid = Grid.covering((0.9, 0.9), (16, 16))
    >>> contact = FrictionalContact(HalfSpace(grid, ElasticPair(body, body)), sphere.friction)
    >>> height, path = sphere.contact.gap(grid.x, grid.y), LoopPath(400.0, 100.0, "force", 4)
    >>> loop = march_loop(contact, height, path)
    >>> errors = loop_errors(contact, height, path, loop)
    >>> off = abs(loop.stiffness - 1.0 / sphere.tangential_compliance)
    >>> print(off < errors.stiffness < 0.1 * loop.stiffness)
    True
    """
    share = 0.5 * OFF * loop.rim / loop.area
    half_space, fine = contact.half_space, contact.grid
    grid = Grid.over(fine.size, _halved(fine.shape), fine.line)
    coarse = FrictionalContact(half_space.on(grid), contact.friction, contact.tolerance)
    shorter = replace(path, increments=max(FEWEST_INCREMENTS, path.increments // 2))
    try:
        other = march_loop(coarse, GridTransfer(fine, grid).averaged(height), shorter)
    except (LoopFailure, ContactProblemError):
        return LoopErrors(share * loop.stiffness, loop.friction, loop.energy)
    power = 2.0 if path.by == "motion" else 1.0
    energy = max(abs(loop.energy - other.energy), power * share * loop.energy)
    return LoopErrors(share * loop.stiffness, abs(loop.friction - other.friction), energy)


def _halved(shape: tuple[int, int]) -> tuple[int, int]:
    nx, ny = ((count + 1) // 2 for count in shape)
    return nx, ny
