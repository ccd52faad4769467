"""What the loads on a user's mesh do to one of its bodies."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.thermal import Temperature
from fe_models.loads.applied_loads import AppliedLoad, BoundaryForce, boundary_of
from fe_models.loads.constraints import Constraints
from fe_models.loads.imposed import Imposing, impose, tie_rigid
from fe_models.loads.nodal_force import forces_of
from fe_models.loads.pretension import Pretension
from sa_solver.types import Array, Indices


class LoadCases:
    """What loads do to a body with such ``groups``, each a column.

    ``forces`` on its nodes, ``straining`` ones that are the body's own, ``imposed`` displacements
    and ``jumps``, ``(size, cases)``; ``loaded`` are boundaries with tractions, ``moved`` the loads
    that impose something. ``sets`` are the vertices of its node sets.
    """

    def __init__(
        self, elastic: ElasticBody, thermal: Array, groups: set[str], sets: Mapping[str, Indices]
    ) -> None:
        self._elastic, self._thermal, self._groups, self._sets = elastic, thermal, groups, sets
        shape = elastic.size, thermal.shape[1]
        self.forces, self.straining, self.imposed, self.jumps = np.zeros((4, *shape))
        self.loaded: list[str] = []
        self.moved: list[Imposing] = []

    def add(self, case: int, load: AppliedLoad, constraints: Constraints) -> None:
        """A load, with what it holds and ties among the ``constraints``."""
        elastic, boundary = self._elastic, boundary_of(load)
        if boundary is not None and boundary not in self._groups:
            return
        if isinstance(load, Imposing):
            self.moved.append(load)
            self.imposed[:, case] = impose(constraints, elastic, load)
        elif isinstance(load, Temperature):
            self.straining[:, case] = elastic.thermal_load(self._thermal[:, case])
        elif isinstance(load, Pretension):
            if load.body == elastic.body.name:
                self.jumps[:, case] = load.jump(elastic)
                self.straining[:, case] = elastic.stiffness @ self.jumps[:, case]
        else:
            self.forces[:, case] = forces_of(load, elastic, self._sets)
            if isinstance(load, BoundaryForce) and load.rigid:
                at = elastic.nodes[elastic.boundary_nodes(load.boundary)].mean(axis=0)
                tie_rigid(constraints, elastic, load.boundary, at)
            if boundary is not None and boundary in elastic.body.mesh.boundaries:
                self.loaded.append(boundary)
