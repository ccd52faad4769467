"""Contacts of similar bodies that wear by the energy law, as several tests build them."""

from __future__ import annotations

from typing import Any

import numpy as np

from sa_solver.types import Array, ElasticPair, Grid, Material
from wear.contact.drive import Drive
from wear.contact.interface import InterfaceContact
from wear.contact.settings import InterfaceSettings
from wear.contact.transfer import CellNodes
from wear.laws import EnergyLaw
from wear.steps.implicit import ImplicitStepper

BODY, STEEL = Material(115e3, 0.29), Material(200e3, 0.3)
PAIR = ElasticPair(BODY, BODY)
FRICTION, COEFFICIENT = 0.5, 1e-8


def interface(grid: Grid, gap: Array, drive: Drive, **settings: Any) -> InterfaceContact:
    """Return a driven contact over a gap, which may be constant along y."""
    usual: dict[str, Any] = {
        "name": "contact",
        "grid": grid,
        "gap": np.ascontiguousarray(np.broadcast_to(gap, grid.shape)),
        "transfer": CellNodes(grid),
        "pair": PAIR,
        "laws": (EnergyLaw(COEFFICIENT), EnergyLaw(COEFFICIENT)),
        "friction": lambda energy: FRICTION,
        "stepper": ImplicitStepper(),
        "tolerance": 1e-10,
        "drive": drive,
    }
    return InterfaceContact(InterfaceSettings(**usual | settings))
