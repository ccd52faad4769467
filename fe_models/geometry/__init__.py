"""Geometries: parametric ones, meshed with gmsh, and the bodies of a user's mesh or CAD file.

- ``Dovetail``: blade root and disk sector of a dovetail joint
- ``Specimen``: the two cylinders with crossed strips of a friction rig
- ``read_bodies``, ``ImportedMesh``: bodies from gmsh, Abaqus, CAD and what meshio reads
- ``describe_bodies``: lines that list what such a file has

Two crossed strips of radii 100 mm touch like spheres, half a millimetre from the middle they are
0.5²/100 mm apart:

>>> import numpy as np
>>> from fe_models.geometry import Specimen
>>> gap = Specimen(radii=(100.0, 100.0)).gap(np.array([0.0, 0.5]), np.zeros(2))
>>> print(gap.round(6))
[0.     0.0025]
"""

from typing import TYPE_CHECKING

from fe_models.lazy import lazy_names

if TYPE_CHECKING:
    from fe_models.geometry.dovetail import Dovetail as Dovetail
    from fe_models.geometry.imported import ImportedMesh as ImportedMesh
    from fe_models.geometry.imported import describe_bodies as describe_bodies
    from fe_models.geometry.imported import read_bodies as read_bodies
    from fe_models.geometry.specimens import Specimen as Specimen

_MODULES = {
    "Dovetail": "dovetail",
    "ImportedMesh": "imported",
    "Specimen": "specimens",
    "describe_bodies": "imported",
    "read_bodies": "imported",
}
__all__ = [*_MODULES]
__getattr__ = lazy_names(__name__, _MODULES)
