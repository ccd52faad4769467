"""Forces, displacements and constraints of the loads on a user's mesh, for one of its bodies."""

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
    """Load cases of a body, one column for each load.

    Attributes
    ----------
    forces
        Nodal forces ``(size, cases)``.
    straining
        Nodal forces of thermal expansion and pretension ``(size, cases)``, which do not act from
        outside.
    imposed
        Imposed displacements ``(size, cases)``.
    jumps
        Displacements of a part of the body that cause no strain ``(size, cases)``.
    loaded
        Boundaries with tractions.
    moved
        Loads that impose displacements.
    """

    def __init__(
        self, elastic: ElasticBody, thermal: Array, groups: set[str], sets: Mapping[str, Indices]
    ) -> None:
        """Start without loads.

        ``thermal`` ``(vertices, cases)`` are expansions, ``groups`` the names of the body's
        boundaries and node sets, and ``sets`` the vertices of its node sets.
        """
        self._elastic, self._thermal, self._groups, self._sets = elastic, thermal, groups, sets
        shape = elastic.size, thermal.shape[1]
        self.forces, self.straining, self.imposed, self.jumps = np.zeros((4, *shape))
        self.loaded: list[str] = []
        self.moved: list[Imposing] = []

    def add(self, case: int, load: AppliedLoad, constraints: Constraints) -> None:
        """Add a load as a case, and its constraints and ties to ``constraints``."""
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
