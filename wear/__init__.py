"""Wear laws, wearing contacts, the coupled wear loop, and wear kinetics.

Wear laws
    - ``WearLaw``: the protocol of all laws, the depth that one body loses in a cycle.
    - ``ArchardLaw``: depth from pressure and slip.
    - ``EnergyLaw``: depth from the energy that friction dissipates.
    - ``EnergyAmplitudeLaw``: the energy law with a coefficient that grows with slip amplitude.
    - ``EvolvingLaw``: any law, times a factor that changes with the energy dissipated so far.
    - ``EnergyTable``: a table of such a factor against energy.

Contacts and wear steps
    - ``InterfaceSettings``: grid, gap, materials and laws of the contact of one interface.
    - ``CellNodes``: the transfer of a face whose nodes are the cells of its grid.
    - ``InterfaceContact``: the contact of one interface, and its wear under a cycle.
    - ``ExplicitStepper``, ``ImplicitStepper``: steppers of first order.
    - ``HeunStepper``, ``SecondOrderStepper``: steppers of second order. The first needs a contact
      whose pressures are given, the second solves the contact within each step.
    - ``ErrorControl``: the error of the depth that sets the length of the steps.
    - ``ContactFailure``: raised where a contact problem within a step does not converge.

The coupled loop
    - ``CycleLoads``: the loads and slips of one contact over a closed cycle.
    - ``ConstantLoads``: a source of loads that wear does not change.
    - ``CoupledSettings``, ``JumpSize``, ``Stop``: length of a run, length of its jumps, and when
      the loads are solved again.
    - ``Contacts``: the contacts of all interfaces, which wear one after the other.
    - ``CoupledWear``: the loop of loads, contacts, wear, and worn gaps that change the loads.
    - ``CoupledState``: everything that is needed to resume a run.
    - ``Observer``: the base class of everything that follows a run, such as logs and records.

Evaluation
    - ``linear_regime``: the rate after running-in, and how far it can be extrapolated.
    - ``ruiz``, ``findley``, ``smith_watson_topper``: parameters of crack initiation.

Contacts at nodes are in :mod:`wear.contact.nodes`, joints of vibrating structures in
:mod:`wear.joints`, and wear between two scans in :mod:`wear.scar`. The example is a cylinder of
10 mm diameter that is pressed by 50 N/mm and slides 40 µm per cycle:

>>> import numpy as np
>>> from sa_solver import ElasticPair, Grid, LoadHistory, Material
>>> from wear import *
>>> grid, steel = Grid.line_contact(1.4, 70), Material(210e3, 0.3)
>>> contact = InterfaceSettings(
...     name="cylinder", grid=grid, gap=grid.x**2 / 20.0, transfer=CellNodes(grid),
...     pair=ElasticPair(steel, steel), laws=(EnergyLaw(5e-9), EnergyLaw(5e-9)),
...     friction=lambda energy: 0.5, stepper=ImplicitStepper(ErrorControl(0.01)),
... )
>>> zero, slip = np.zeros(1), np.zeros((1, 2, 70))
>>> slip[:, 0] = 0.04
>>> loads = [CycleLoads(LoadHistory(zero + 50.0, *[zero] * 7, sliding=zero == 0.0), slip)]
>>> contacts = Contacts([InterfaceContact(contact)])
>>> loop = CoupledWear(CoupledSettings(cycles=1e5), ConstantLoads(loads), contacts)
>>> state, first = loop.begin(loads)
>>> *_, end = loop.march(state)
>>> print(f"{end.volume:.6f} mm^3/mm of {1e-8 * 0.5 * 50.0 * 0.04 * 1e5:.6f}")
0.001000 mm^3/mm of 0.001000
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from wear.contact.contacts import Contacts
    from wear.contact.face_loads import CycleLoads
    from wear.contact.interface import InterfaceContact
    from wear.contact.settings import InterfaceSettings
    from wear.contact.transfer import CellNodes
    from wear.coupled import CoupledWear
    from wear.coupled_state import CoupledState, Observer
    from wear.cracking.life import findley, ruiz, smith_watson_topper
    from wear.evolution import EnergyTable
    from wear.kinetics import linear_regime
    from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw, WearLaw
    from wear.load_sources import ConstantLoads
    from wear.schedule import CoupledSettings, JumpSize, Stop
    from wear.steps.implicit import ImplicitStepper, SecondOrderStepper
    from wear.steps.step_errors import ErrorControl
    from wear.steps.steppers import ExplicitStepper, HeunStepper
    from wear.steps.stepping import ContactFailure

__all__ = [
    "ArchardLaw",
    "CellNodes",
    "ConstantLoads",
    "ContactFailure",
    "Contacts",
    "CoupledSettings",
    "CoupledState",
    "CoupledWear",
    "CycleLoads",
    "EnergyAmplitudeLaw",
    "EnergyLaw",
    "EnergyTable",
    "ErrorControl",
    "EvolvingLaw",
    "ExplicitStepper",
    "HeunStepper",
    "ImplicitStepper",
    "InterfaceContact",
    "InterfaceSettings",
    "JumpSize",
    "Observer",
    "SecondOrderStepper",
    "Stop",
    "WearLaw",
    "findley",
    "linear_regime",
    "ruiz",
    "smith_watson_topper",
]

__getattr__, __dir__ = lazy_names(__name__)
