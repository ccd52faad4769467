"""Contact mechanics on elastic half-spaces, and the types, frames and signs shared by all packages.

Input
    - ``Material``: an isotropic elastic material, with the layers on its surface.
    - ``Layer``: a layer, such as a coating.
    - ``ElasticPair``: the elastic constants of two bodies in contact.
    - ``Grid``: a uniform grid of cells over a contact, or over the width of a line contact.
    - ``Frame``: the origin and axes of an interface.
    - ``LoadHistory``: the resultants of an interface over a closed cycle.

Solvers
    - ``HalfSpace``: displacement of two half-spaces under tractions on a grid, by FFT.
    - ``NormalContact``: pressure under a force or an approach.
    - ``TangentialContact``: shear and slip under a given pressure.
    - ``CoupledContact``: pressure and shear of dissimilar bodies, solved together.
    - ``FrictionalContact``: increments of a contact with friction, for any pair of bodies.
    - ``ContactLoad``: load or motion imposed at the end of an increment.
    - ``ContactLoadPath``: a sequence of such loads.
    - ``march_history``: the states along a path, at all increments or at turning points only.
    - ``LoopPath``: an imposed oscillating motion or force.
    - ``march_loop``: the resulting hysteresis loop, with stiffness and friction.
    - ``partial_slip_curve``: force against motion up to sliding, from normal problems alone.
    - ``steady_rolling``: creep forces of bodies that roll, and where they stick and slip.
    - ``SubsurfaceStress``: stress inside either body under the tractions.
    - ``von_mises``, ``principal_stresses``: equivalent and principal stresses.

Exceptions
    - ``FretscaleError``: the base class of all exceptions.
    - ``InputError``: data that are meaningless or admit no solution.
    - ``ConvergenceError``: a method that did not converge.

Closed-form solutions for comparison are in :mod:`sa_solver.reference`, measured surfaces in
:mod:`sa_solver.surfaces.scans`. Units are N, mm and MPa; signs are those of :mod:`sa_solver.types`.
A sphere on a flat, compared with Hertz:

>>> from sa_solver import ElasticPair, Grid, HalfSpace, Material, NormalContact
>>> from sa_solver.reference.hertz import HertzSphere
>>> steel, grid = Material(young=210e3, poisson=0.3), Grid.covering((1.0, 1.0), (64, 64))
>>> half_space = HalfSpace(grid, ElasticPair(steel, steel))
>>> hertz = HertzSphere(load=100.0, radius=10.0, contact_modulus=half_space.pair.contact_modulus)
>>> state = NormalContact(half_space).solve(hertz.gap(grid.x, grid.y), P=100.0)
>>> print(f"{state.approach * 1e3:.2f} um, Hertz {hertz.approach * 1e3:.2f} um")
3.48 um, Hertz 3.48 um
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from sa_solver.contact import FrictionalContact
    from sa_solver.contact_state import ContactLoad
    from sa_solver.cycles.history import ContactLoadPath, march_history
    from sa_solver.cycles.partial_slip import partial_slip_curve
    from sa_solver.cycles.rolling import steady_rolling
    from sa_solver.cycles.tangential_loop import LoopPath, march_loop
    from sa_solver.dissimilar.contact import CoupledContact
    from sa_solver.errors import ConvergenceError, FretscaleError, InputError
    from sa_solver.half_space.operator import HalfSpace
    from sa_solver.half_space.stress import principal_stresses, von_mises
    from sa_solver.half_space.subsurface import SubsurfaceStress
    from sa_solver.load_history import LoadHistory
    from sa_solver.normal.contact import NormalContact
    from sa_solver.tangential.contact import TangentialContact
    from sa_solver.types import ElasticPair, Frame, Grid, Layer, Material

__all__ = [
    "ContactLoad",
    "ContactLoadPath",
    "ConvergenceError",
    "CoupledContact",
    "ElasticPair",
    "Frame",
    "FretscaleError",
    "FrictionalContact",
    "Grid",
    "HalfSpace",
    "InputError",
    "Layer",
    "LoadHistory",
    "LoopPath",
    "Material",
    "NormalContact",
    "SubsurfaceStress",
    "TangentialContact",
    "march_history",
    "march_loop",
    "partial_slip_curve",
    "principal_stresses",
    "steady_rolling",
    "von_mises",
]

__getattr__, __dir__ = lazy_names(__name__)
