"""Geometries: parametric ones, meshed with gmsh, and the bodies of a user's mesh or CAD file.

- ``Dovetail``: blade root and disk sector of a dovetail joint
- ``Specimen``: the two cylinders with crossed strips of a friction rig
- ``read_bodies``, ``ImportedMesh``: bodies from gmsh, Abaqus, CAD and all files that meshio reads
- ``describe_bodies``: lines that list the content of such a file

Two crossed strips of radii 100 mm touch like spheres. Half a millimetre from the centre they are
0.5²/100 mm apart:

>>> import numpy as np
>>> from fe_models.geometry import Specimen
>>> gap = Specimen(radii=(100.0, 100.0)).gap(np.array([0.0, 0.5]), np.zeros(2))
>>> print(gap.round(6))
[0.     0.0025]
"""

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from fe_models.geometry.dovetail import Dovetail
    from fe_models.geometry.imported import ImportedMesh, describe_bodies, read_bodies
    from fe_models.geometry.specimens import Specimen

__all__ = [
    "Dovetail",
    "ImportedMesh",
    "Specimen",
    "describe_bodies",
    "read_bodies",
]

__getattr__, __dir__ = lazy_names(__name__)
