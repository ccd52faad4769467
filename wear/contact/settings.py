"""Settings of one interface and of its wear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.normal.contact import checked_heights
from sa_solver.types import Array, ElasticPair, Grid
from wear.contact.drive import Drive
from wear.contact.transfer import Transfer
from wear.laws import WearLaw
from wear.steps.steppers import Stepper
from wear.steps.stepping import WearingContact, WearState

# Tolerance of shear over that of pressures, and its lower bound.
SHEAR_SHARE, TIGHTEST = 0.01, 1e-8


@dataclass(frozen=True)
class InterfaceSettings:
    """Settings of one interface and of its wear.

    Parameters
    ----------
    name
        Name of the interface, used in messages.
    grid
        Grid of the contact.
    gap
        Gap of the unloaded, unworn bodies ``(nx, ny)`` [mm], infinite or masked where one of them
        has no surface.
    transfer
        Transfer between the nodes of the loads and the grid; :class:`wear.CellNodes` where the
        nodes are the cells.
    pair
        Elastic constants of both bodies.
    laws
        Wear laws of body 1 and body 2.
    friction
        Function that returns Coulomb's coefficient after a dissipated energy [N mm].
    stepper
        Method and length of the wear steps.
    method
        Source of the slips. "normal": the loads; "full": the half-space with its own friction.
    gross_slip
        Direction of gross slip with ``method`` full: that of the force, or that by which the
        energies of the loads are dissipated.
    drive
        Motions imposed in place of the forces of the loads (:class:`wear.contact.drive.Drive`).
    follow
        Whether the wear of surfaces that move over each other follows that motion; None: where it
        matters (:func:`wear.contact.moving.moves`).
    link
        "corrected": the half-spaces are corrected for all other deformation of the structure's
        bodies (:mod:`wear.contact.link`), where the loads contain nodal forces and displacements.
        "half_space": they are not.
    tolerance
        Relative tolerance of pressures. Shear is solved more tightly: :attr:`shear_tolerance`.

    Examples
    --------
    A steel cylinder and a steel flat wear by Archard's law:

    >>> from sa_solver import ElasticPair, Grid, Material
    >>> from wear import ArchardLaw, CellNodes, ImplicitStepper, InterfaceSettings
    >>> grid, steel, law = Grid.line_contact(1.4, 70), Material(210e3, 0.3), ArchardLaw(1e-4,
    ...     3000.0)
    >>> settings = InterfaceSettings(
    ...     name="cylinder", grid=grid, gap=grid.x**2 / 20.0, transfer=CellNodes(grid),
    ...     pair=ElasticPair(steel, steel), laws=(law, law),
    ...     friction=lambda energy: 0.5, stepper=ImplicitStepper(),
    ... )
    >>> print(settings.method, settings.friction(0.0))
    normal 0.5
    """

    name: str
    grid: Grid
    gap: Array
    transfer: Transfer
    pair: ElasticPair
    laws: tuple[WearLaw, WearLaw]
    friction: Callable[[float], float]
    stepper: Stepper[WearState, WearingContact]
    method: Literal["normal", "full"] = "normal"
    gross_slip: Literal["force", "energies"] = "force"
    drive: Drive = field(default_factory=Drive)
    follow: bool | None = None
    link: Literal["corrected", "half_space"] = "corrected"
    tolerance: float = 1e-8

    @property
    def shear_tolerance(self) -> float:
        """Relative tolerance of contact with friction: a hundredth of ``tolerance``, down to 1e-8.

        The energy of small slips is a small difference of large forces.
        """
        return min(self.tolerance, max(TIGHTEST, SHEAR_SHARE * self.tolerance))

    def __post_init__(self) -> None:
        checks.settle(self, gap=checked_heights(self.gap, self.grid))
        checks.choice("method", self.method, ("normal", "full"))
        checks.choice("link", self.link, ("corrected", "half_space"))
        if self.pair.layered:
            raise InputError(
                f"bodies of {self.name} have layers, which do not wear: leave them out"
            )
