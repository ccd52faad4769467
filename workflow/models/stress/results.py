"""Stress of a wear model as groups of labelled arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_models.elasticity.stress import PeakStress, StressField
from fe_models.meshes.structure_mesh import Body, StructureMesh
from sa_solver.half_space.stress import von_mises
from sa_solver.half_space.subsurface import COMPONENTS
from sa_solver.types import Array
from workflow.layout.declared import declared
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.stress.contact_stress import STUCK_SHARE, InterfaceStress
from workflow.models.stress.layout import BODY, LIFE, MOMENTS, SECTION, SECTION_AXES
from workflow.models.stress.structure_stress import StressedStructure, formed_meshes

if TYPE_CHECKING:
    import xarray as xr

# Dimensions of a value that both bodies have, unworn and worn, and that of the bodies alone.
STATE, BODIES = "state", "body"
COMPONENT = "stress_component"
NOTCH = declared("""
    notch_stress | MPa | | largest von Mises stress on the free surface at peak load
    notch_principal | MPa | | largest principal stress on the free surface at peak load
    notch_error | 1 | | estimated error by the mesh, relative; 1 where the stress has no limit
    notch_place | mm | axis | place of the largest von Mises stress on the free surface
""")


@dataclass(frozen=True)
class StressResults:
    """Stress of the bodies of a ``structure``, if there is one, and under each contact.

    Each contact face has a group ``section`` and a group ``life`` with the bodies and the unworn
    and the worn ``state`` as dimensions. Each body of a structure has a group in ``bodies``.
    """

    structure: StressedStructure | None
    contacts: Sequence[InterfaceStress]

    @cached_property
    def _formed(self) -> tuple[dict[str, StructureMesh], str]:
        """Meshes of the structure by moment, and why they lack the form of their faces."""
        assert self.structure is not None
        return formed_meshes(self.structure.source.mesh, self.structure.mesh)

    def groups(self) -> dict[str, xr.Dataset]:
        """Return the groups of all faces and bodies by their paths."""
        groups = {}
        for stress in self.contacts:
            if stress.planes.settings.section != "none":
                groups[f"{stress.name}/section"] = _section(stress)
            if stress.mapped:
                groups[f"{stress.name}/life"] = _life(stress)
        if self.structure is not None:
            for number, body in enumerate(self.structure.mesh.bodies):
                bodies = [mesh.bodies[number] for mesh in self._formed[0].values()]
                fields = [self.structure.stresses[m].fields[number] for m in MOMENTS]
                groups[f"bodies/{body.name}"] = _body(bodies, fields)
        return groups

    def faults(self, peak: int) -> Iterator[Notice]:
        """Return what the stress lacks; ``peak`` is the increment of peak load."""
        if self.structure is not None and self._formed[1]:
            text = f"{self._formed[1]}: points of bodies are those of the worn shape alone"
            yield Notice(WarningKind.WORN_MESH_SIMPLIFIED, text)
        for stress in self.contacts:
            if (stuck := stress.stuck[peak]) > STUCK_SHARE:
                yield Notice(
                    WarningKind.UNKNOWN_SHEAR,
                    f"{stress.name}: {100.0 * stuck:.0f} % of the peak load sticks, and method "
                    "normal does not know its shear, which section and life lack: use method full",
                )
            elif count := int((stress.stuck > STUCK_SHARE).sum()):
                yield Notice(
                    WarningKind.UNKNOWN_SHEAR,
                    f"{stress.name}: the life leaves out {count} increments, in which method "
                    "normal does not know the shear of a contact that sticks: use method full",
                )
            if self.structure is not None and (warning := stress.carried_warning):
                yield warning


def _section(stress: InterfaceStress) -> xr.Dataset:
    """Return the section through a contact."""
    import xarray as xr

    sections = [
        [body.section for body in contact.bodies.values()] for contact in stress.moments.values()
    ]
    found = np.array(sections)
    values = {"stress": found, "von_mises": np.array([list(map(von_mises, of)) for of in found])}
    planes, axes = stress.planes, declared(SECTION_AXES)
    return xr.Dataset(
        _of_bodies(SECTION, values),
        coords={
            **_coordinates(stress),
            COMPONENT: list(COMPONENTS),
            "along": axes["along"].variable(planes.along),
            "depths": axes["depths"].variable(planes.depths),
        },
        attrs={"axis": planes.settings.section, "at": planes.at, "bulk_stress": int(stress.bulk)},
    )


def _life(stress: InterfaceStress) -> xr.Dataset:
    """Return the maps of the fretting parameter over a contact."""
    import xarray as xr

    moments = [list(contact.bodies.values()) for contact in stress.moments.values()]
    values = {
        name: np.array([[body.maps[name] for body in bodies] for bodies in moments])
        for name in moments[0][0].maps
    }
    settings = stress.planes.settings
    return xr.Dataset(
        _of_bodies(LIFE, values),
        coords=_coordinates(stress),
        attrs={
            "parameter": settings.parameter,
            "depth": settings.critical_distance,
            "bulk_stress": int(stress.bulk),
        },
    )


def _coordinates(stress: InterfaceStress) -> dict[str, Any]:
    """Return the moments and the numbers of the bodies that have stresses."""
    return {STATE: list(MOMENTS), BODIES: list(stress.moments[MOMENTS[0]].bodies)}


def _of_bodies(text: str, values: Mapping[str, Array]) -> dict[str, xr.Variable]:
    """Return values of all moments and bodies as variables, as the ``text`` declares them."""
    described = declared(text)
    return {
        name: described[name].over(STATE, BODIES).variable(array) for name, array in values.items()
    }


def _body(bodies: Sequence[Body], fields: Sequence[StressField]) -> xr.Dataset:
    """Return mesh and stress of a body by moment, and the largest stress on its free surface."""
    import xarray as xr

    described = declared(BODY)
    of_states = {
        "points": np.array([body.points for body in bodies]),
        "displacement": np.array([field.displacement for field in fields]),
        "stress": np.array([field.stress for field in fields]),
        "von_mises": np.array([field.von_mises for field in fields]),
        "maximum_principal": np.array([field.maximum_principal for field in fields]),
    }
    variables = {
        name: described[name].over(STATE).variable(values) for name, values in of_states.items()
    }
    notches = [field.notch for field in fields if field.notch is not None]
    if len(notches) == len(fields):
        variables |= _notch(notches)
    return xr.Dataset(
        variables | {"elements": described["elements"].variable(bodies[0].mesh.t.T)},
        coords={STATE: list(MOMENTS), COMPONENT: list(COMPONENTS), "axis": ["X", "Y", "Z"]},
    )


def _notch(notches: list[PeakStress]) -> dict[str, xr.Variable]:
    """Return the largest stresses on the free surface of a body."""
    values = {
        "notch_stress": [notch.von_mises for notch in notches],
        "notch_principal": [notch.maximum_principal for notch in notches],
        "notch_error": [notch.error for notch in notches],
        "notch_place": [notch.place for notch in notches],
    }
    return {
        name: NOTCH[name].over(STATE).variable(np.array(array)) for name, array in values.items()
    }
