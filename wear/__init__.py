"""Wear laws, surfaces, cycle stepping and kinetics.

How much is worn
    - ``WearLaw``: the protocol of all laws, the depth that one body loses in a cycle.
    - ``ArchardLaw``: depth from pressure and slip.
    - ``EnergyLaw``: depth from the energy that friction dissipates.
    - ``EnergyAmplitudeLaw``: the same with a coefficient that grows with the slip amplitude.
    - ``EvolvingLaw``: any of them, times a factor that changes with the energy dissipated so far.
    - ``EnergyTable``: such a factor.

What is worn
    - ``Surfaces``: gap, depths and energies of the two surfaces of an interface.
    - ``SlidingCycle``: loads and slips of a closed cycle.
    - ``march_cycle``: such a cycle of a contact whose slip follows from its loads.
    - ``WearingContact``: an interface under a cycle, with a law for either body.
    - ``WearState``: what wear must remember from one step to the next.
    - ``ContactFailure``: a contact problem in between did not converge.

In which steps
    - ``Explicit``, ``Implicit``, ``SecondOrder``: steppers of first and second order.
    - ``ErrorControl``: the error of the depth that chooses their length.
    - ``advance_cycles``: so many cycles in as many steps as it takes.

What follows
    - ``linear_regime``: the rate after running-in, and how far it can be extrapolated.
    - ``ruiz``, ``findley``, ``smith_watson_topper``: where cracks start.

Joints of vibrating structures, and how they wear, are in :mod:`wear.joints`. A coefficient that
falls to half while the first joule is dissipated:

>>> from wear import EnergyTable
>>> table = EnergyTable(energy=(0.0, 1e3), factor=(1.0, 0.5))
>>> print(table.at(500.0), table.mean(0.0, 2e3))
0.75 0.625
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from wear.evolution import EnergyTable
    from wear.full_cycle import march_cycle
    from wear.kinetics import linear_regime
    from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw, WearLaw
    from wear.life import findley, ruiz, smith_watson_topper
    from wear.steppers import ErrorControl, Explicit, Implicit, SecondOrder, advance_cycles
    from wear.stepping import ContactFailure, SlidingCycle, WearingContact, WearState
    from wear.surfaces import Surfaces

__all__ = [
    "ArchardLaw",
    "ContactFailure",
    "EnergyAmplitudeLaw",
    "EnergyLaw",
    "EnergyTable",
    "ErrorControl",
    "EvolvingLaw",
    "Explicit",
    "Implicit",
    "SecondOrder",
    "SlidingCycle",
    "Surfaces",
    "WearLaw",
    "WearState",
    "WearingContact",
    "advance_cycles",
    "findley",
    "linear_regime",
    "march_cycle",
    "ruiz",
    "smith_watson_topper",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "evolution": ("EnergyTable",),
        "full_cycle": ("march_cycle",),
        "kinetics": ("linear_regime",),
        "laws": ("ArchardLaw", "EnergyAmplitudeLaw", "EnergyLaw", "EvolvingLaw", "WearLaw"),
        "life": ("findley", "ruiz", "smith_watson_topper"),
        "steppers": ("ErrorControl", "Explicit", "Implicit", "SecondOrder", "advance_cycles"),
        "stepping": ("ContactFailure", "SlidingCycle", "WearState", "WearingContact"),
        "surfaces": ("Surfaces",),
    },
)
