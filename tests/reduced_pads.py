"""Reduced specimens of crossed strips, shared by the tests of the rig."""

from __future__ import annotations

from functools import cache

from fe_models.geometry.specimens import Specimen
from fe_models.meshes.structure_mesh import Interface, StructureMesh
from fe_models.specimens import pad_stiffness, reduced_specimens
from sa_solver.types import Array, Material

STEEL = Material(200e3, 0.3, 7.8e-9)
FRICTION, STROKE = 0.88, 14e-3
# Depth per energy: 1500 µm³/J, the slope of the rig's tests.
ALPHA = 1.5e-9
# Relative tolerance for the solver's rounding and its exchange of nodes.
SOLVER = 1e-9


def pad_stiffnesses(specimen: Specimen, mesh: StructureMesh) -> list[Array]:
    """Return the stiffness of both bodies in steel."""
    models = reduced_specimens(specimen, mesh, (STEEL, STEEL), modes=0)
    return [pad_stiffness(model, specimen) for model in models]


@cache
def coarse_pads() -> tuple[Interface, list[Array]]:
    """Return the pad of a coarse pair with its curved gap, and the stiffness of both bodies."""
    specimen = Specimen(pad_elements=6, radii=(1000.0, 50.0))
    mesh = specimen.mesh(2.0)
    return mesh.interfaces[0], pad_stiffnesses(specimen, mesh)
