"""Stress of the bodies of a structure, on unworn and on worn faces."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from fe_models.elasticity.stress import CycleStress
from fe_models.meshes.cut_face import WholeStress, whole_components, whole_values
from fe_models.meshes.remesh import form_of, formed_mesh
from fe_models.meshes.structure_mesh import Interface, MeshError, StructureMesh
from fe_models.structure import CycleSolution, InterfaceHistory
from sa_solver.transforms.threads import begun
from sa_solver.types import Array
from workflow.models.contact import WornFaces
from workflow.models.stress.layout import MOMENTS
from workflow.models.stress.notch_stress import with_local_models
from workflow.models.structure import StructureLoads


@dataclass(frozen=True)
class StressedStructure:
    """A structure before and after wear, with the stresses of its bodies by moment.

    ``mesh`` and ``cycle`` are the worn ones.
    """

    source: StructureLoads
    mesh: StructureMesh
    cycle: CycleSolution
    stresses: Mapping[str, CycleStress]

    @classmethod
    def of(
        cls,
        source: StructureLoads,
        mesh: StructureMesh,
        cycle: CycleSolution,
        shown: Sequence[int] = (),
        done: Callable[[], None] = lambda: None,
    ) -> StressedStructure:
        """Return the structure with its stresses at peak load, and in the increments ``shown``.

        For ``done`` see :func:`fe_models.elasticity.stress.cycle_stresses`.
        """
        cycles = {"unworn": source.unworn_cycle, "worn": cycle}
        stresses = source.stresses(cycles, shown, done)
        return cls(source, mesh, cycle, with_local_models(source, cycles, stresses))

    def under(
        self, moment: str, number: int
    ) -> tuple[tuple[Array, Array], tuple[WholeStress, WholeStress], tuple[Array, Array] | None]:
        """Return motions of both faces of interface ``number``, and stress fields at peak load.

        The third value holds the thermal strains of the faces, or None without temperatures.
        """
        stress, interface = self.stresses[moment], self.source.mesh.interfaces[number]
        one, two = (whole_components(interface, moved) for moved in stress.faces[number])
        field_1, field_2 = (
            WholeStress(stress.fields[place], interface) for place in interface.bodies
        )
        if stress.expansions is None:
            return (one, two), (field_1, field_2), None
        hot_1, hot_2 = (whole_values(interface, hot) for hot in stress.expansions[number])
        return (one, two), (field_1, field_2), (hot_1, hot_2)

    def history(self, number: int) -> InterfaceHistory:
        """Return the worn cycle of the whole face of interface ``number``."""
        return self.source.on_faces(self.cycle)[number]


def formed_meshes(
    unworn: StructureMesh, worn: StructureMesh
) -> tuple[dict[str, StructureMesh], str]:
    """Return both meshes by moment, with vertices moved to the form of their faces.

    Stress is not solved on them: the form ends at the border of its face, where the mesh would get
    a corner, a notch that the body does not have. Where an element would fold, the second value
    says so, and vertices stay.
    """
    form, meshes = form_of(unworn), dict(zip(MOMENTS, (unworn, worn), strict=True))
    try:
        return {moment: formed_mesh(mesh, form) for moment, mesh in meshes.items()}, ""
    except MeshError as error:
        return meshes, str(error)


def begin_worn_mesh(source: StructureLoads, faces: WornFaces) -> Callable[[], StructureMesh]:
    """Begin to make the mesh with worn faces in a thread, and return a function that waits for it.

    Solving friction uses one thread, and represents worn faces by their gaps.
    """
    depths = [contact.depths_of_bodies(state) for contact, state in faces]
    meshed = list(map(meshed_depths, source.mesh.interfaces, depths))
    return begun(partial(source.worn_mesh, meshed))


def end_cycle(source: StructureLoads, faces: WornFaces, evolves: bool) -> CycleSolution:
    """Return the cycle on the surfaces at the end of a run.

    If friction ``evolves``, each contact has its coefficient at the end.
    """
    depths = [contact.contact.at_nodes(state.surfaces.depth) for contact, state in faces]
    if not evolves:
        return source.worn_cycle(depths)
    friction = [contact.settings.friction(state.energy) for contact, state in faces]
    return source.worn_cycle(depths, friction)


def meshed_depths(interface: Interface, depths: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the depths of both bodies at meshed nodes, which come first in a whole face."""
    depth_1, depth_2 = depths
    return depth_1[: len(interface.nodes_1)], depth_2[: len(interface.nodes_2)]
