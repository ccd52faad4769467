"""Errors of a tangential loop due to its grid and increments.

The stiffness is proportional to the square root of the area of contact, which consists of whole
cells: it may be too large or too small by a quarter of the cells at its rim. This is a bound,
because two grids may agree by chance. The mobilised friction and the energy are compared with a
loop of half as many cells and increments. The energy of partial slip is proportional to Q³ / kt
(Mindlin & Deresiewicz 1953), and under an imposed motion to kt², so that its error is at least that
which follows from the stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from sa_solver.contact import FrictionalContact
from sa_solver.cycles.tangential_loop import LoopFailure, LoopPath, TangentialLoop, march_loop
from sa_solver.errors import ContactProblemError, InputError
from sa_solver.half_space.nested_grids import GridTransfer
from sa_solver.types import Array, Grid

OFF = 0.25
"""Error of the area, as a share of the cells at the rim. For new and worn spheres of 6 to 29 cells
in radius the true errors were 0.005 to 0.8 of this, so that it is a bound."""

FEWEST_INCREMENTS = 2
"""Least number of increments of a branch."""


@dataclass(frozen=True)
class LoopErrors:
    """Estimated errors of a loop: ``stiffness`` [N/mm], ``friction`` [1], ``energy`` [N mm].

    They are per mm on line grids. ``friction`` is the error of :attr:`TangentialLoop.friction`, the
    mobilised friction; it is almost 0 where the contact slides.
    """

    stiffness: float
    friction: float
    energy: float


def loop_errors(
    contact: FrictionalContact, height: Array, path: LoopPath, loop: TangentialLoop
) -> LoopErrors:
    """Estimate the errors of a loop of :func:`march_loop`, by its rim and by a coarser loop.

    The coarser loop has half as many cells and increments, but at least 2 per branch. If it does
    not converge, the errors of friction and energy are as large as these.

    Parameters
    ----------
    contact, height, path
        The arguments of :func:`march_loop`.
    loop
        Its result.

    Raises
    ------
    InputError
        For a contact whose friction depends on place or pressure.

    Examples
    --------
    For a sphere in partial slip the stiffness differs from that of Mindlin 1949 (J. Appl. Mech. 16,
    259) by less than the estimated error:

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
    if contact.factor is not None:
        raise InputError(
            "a factor of friction is not known on the coarser grid: compare loops of your own grids"
        )
    share = 0.5 * OFF * loop.rim / loop.area
    half_space, fine = contact.half_space, contact.grid
    grid = Grid.over(fine.size, _halved(fine.shape), fine.line)
    coarse = FrictionalContact(
        half_space.on(grid), contact.friction, contact.tolerance, hardness=contact.hardness
    )
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
