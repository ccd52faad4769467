"""Contacts that wear under loads that are formulas: a cylinder, and a patch whose load falls."""

from dataclasses import replace

import numpy as np

from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, ElasticPair, Grid, Material
from wear.contact.contacts import Contacts
from wear.contact.face_loads import CycleLoads
from wear.contact.interface import InterfaceContact
from wear.contact.settings import InterfaceSettings
from wear.contact.transfer import CellNodes
from wear.coupled import CoupledWear
from wear.coupled_state import CoupledState
from wear.laws import EnergyLaw
from wear.load_sources import ConstantLoads
from wear.schedule import CoupledSettings
from wear.steps.implicit import ImplicitStepper

BODY = Material(115e3, 0.29)
PAIR = ElasticPair(BODY, BODY)
FRICTION, SLIP = 0.5, 0.04
COEFFICIENTS = 5e-8, 1e-8
# Volume of both bodies per cycle and load [mm³/N].
PER_LOAD = sum(COEFFICIENTS) * FRICTION * SLIP
RADIUS = 10.0


def cylinder(**settings) -> InterfaceSettings:
    """Return a line contact with 70 cells."""
    grid = Grid.line_contact(1.4, 70)
    return interface(grid, grid.x**2 / (2.0 * RADIUS), **settings)


def patch(**settings) -> InterfaceSettings:
    """Return a flat of 1 mm on a step that never touches."""
    grid = Grid.line_contact(1.2, 24)
    return interface(grid, np.where(np.abs(grid.x) < 0.5, 0.0, 1.0), **settings)


def interface(grid: Grid, gap: Array, **settings) -> InterfaceSettings:
    return InterfaceSettings(
        **{
            "name": "contact",
            "grid": grid,
            "gap": np.ascontiguousarray(gap),
            "transfer": CellNodes(grid),
            "pair": PAIR,
            "laws": tuple(EnergyLaw(coefficient) for coefficient in COEFFICIENTS),
            "friction": lambda energy: FRICTION,
            "stepper": ImplicitStepper(),
            "follow": False,
            "tolerance": 1e-10,
        }
        | settings
    )


AREA = 1.0  # of the patch, per length


class Falling:
    """Loads of patches that fall with their mean worn depth h as P0 (1 - h/h0)."""

    def __init__(self, loads: tuple[float, ...], depth: float, grid: Grid) -> None:
        self._loads, self._depth, self._grid = loads, depth, grid
        self.solved: list[list[float]] = []
        self.probed = 0

    def forces(self, depths: list[Array]) -> list[float]:
        means = [depth.sum() * self._grid.cell_area / AREA for depth in depths]
        pairs = zip(self._loads, means, strict=True)
        return [load * (1.0 - mean / self._depth) for load, mean in pairs]

    def worn(self, depths: list[Array], friction=None) -> list[CycleLoads]:
        self.solved.append(self.forces(depths))
        return [cycle(load, self._grid) for load in self.solved[-1]]

    def unworn(self) -> list[CycleLoads]:
        return [cycle(load, self._grid) for load in self._loads]

    def probe(self, depths: list[Array], friction=None) -> Array:
        self.probed += 1
        return np.array([[load, *[0.0] * 5] for load in self.forces(depths)])


def cycle(load: float, grid: Grid) -> CycleLoads:
    """Return a cycle of sliding forward and backward as a whole, under a load."""
    zero = np.zeros(2)
    slip = 0.5 * SLIP * np.array([1.0, -1.0])[:, None, None] * [[[1.0], [0.0]]]
    loads = LoadHistory(zero + load, *(zero,) * 7, sliding=np.ones(2, dtype=bool))
    cells = grid.shape[0] * grid.shape[1]
    return CycleLoads(loads, np.broadcast_to(slip, (2, 2, cells)).copy())


def forward_and_backward(load: float, grid: Grid) -> CycleLoads:
    """Return a cycle of sliding forward under a load and backward under a smaller one."""
    there = cycle(load, grid)
    return replace(there, loads=replace(there.loads, P=load * np.array([1.0, 0.4])))


def run(settings: CoupledSettings, source: Falling, contacts, *observers) -> list[CoupledState]:
    """Return all states of a run, the unworn one first."""
    loop = CoupledWear(settings, source, in_turn(contacts), observers)
    state, _ = loop.begin(source.unworn())
    return [state, *loop.march(state)]


def run_constant(
    settings: CoupledSettings, load: float, contact: InterfaceSettings
) -> CoupledState:
    """Return the end of a run of one contact under a constant load."""
    histories = [cycle(load, contact.grid)]
    loop = CoupledWear(settings, ConstantLoads(histories), in_turn([contact]))
    state, _ = loop.begin(histories)
    *_, end = loop.march(state)
    return end


def in_turn(contacts: list[InterfaceSettings]) -> Contacts:
    return Contacts([InterfaceContact(settings) for settings in contacts])


FALL = 1e-3  # h0 [mm]
LOAD = 80.0
# Cycles in which the remaining volume falls to 1/e.
SCALE = AREA * FALL / (PER_LOAD * LOAD)


def falling(*loads: float) -> Falling:
    return Falling(loads or (LOAD,), FALL, patch().grid)
