"""The two specimens of a case: mesh, reduced models and natural frequencies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fe_models.geometry.specimens import Specimen
from fe_models.joints.reduced_contact import ReducedPair
from fe_models.joints.reduction import ReducedModel, free_frequencies
from fe_models.meshes.structure_mesh import Interface, StructureMesh
from fe_models.specimens import STEPS, pad_stiffness, reduced_specimens, specimen_matrices
from sa_solver.types import Array, Grid, Progress, Tally, unseen
from workflow.analyses.specimens.case import SpecimensCase
from workflow.shell.folders.cache import content_key, load_arrays, save_arrays

# Rigid motions of a free body, and number of natural frequencies above them to compare.
RIGID_MOTIONS, FREQUENCIES = 6, 6


@dataclass(frozen=True)
class SpecimenReduction:
    """Reduced models of body 1 and 2, and natural frequencies of each, free, ``(6,)`` [Hz].

    ``frequencies`` of a body are those of its finite elements and those of its reduced model.
    """

    models: tuple[ReducedModel, ReducedModel]
    frequencies: tuple[tuple[Array, Array], ...]


class SpecimensModel:
    """The specimens as the case gives them.

    If a target distance from the contact is given [mm], their reduced models keep a target too.
    """

    def __init__(self, case: SpecimensCase, target_distance: float | None = None) -> None:
        self.case, self._target = case, target_distance
        self._progress: Progress = unseen
        self.specimen: Specimen = case.geometry()
        self._materials = case.elastic
        self.from_cache = False

    @cached_property
    def mesh(self) -> StructureMesh:
        """Mesh of both specimens.

        Raises :class:`~fe_models.meshes.structure_mesh.MeshError`.
        """
        mesh = self.case.meshed()
        (face,) = mesh.interfaces
        for scanned in self.case.scanned():
            face = replace(face, gap=face.gap + scanned.at_nodes())
        return replace(mesh, interfaces=(face,)).weighted(self.case.mesh.order)

    @property
    def face(self) -> Interface:
        """Interface of the pad."""
        (face,) = self.mesh.interfaces
        return face

    def gap(self, grid: Grid) -> Array:
        """Return the gap of the unloaded, unworn pads on the cells of a grid ``(nx, ny)`` [mm]."""
        gap = self.specimen.gap(grid.x, grid.y)
        surfaces = self.case.structure.surfaces
        return gap if surfaces is None else gap + surfaces.gap(grid)

    @cached_property
    def reduction(self) -> SpecimenReduction:
        """Reduced models and frequencies, from the cache if they are there.

        Form and measured surfaces enter as a gap only, so that all specimens share these models.
        """
        case = self.case
        flat = replace(self.specimen, radii=None)
        modes = case.reduction.modes
        further = () if self._target is None else (self._target,)
        key = content_key("specimens", flat, self._materials, case.mesh, modes, *further)
        arrays = load_arrays(f"specimens-{key}")
        self.from_cache = arrays is not None
        if arrays is None:
            arrays = self._reduce(modes)
            save_arrays(f"specimens-{key}", arrays)
        return SpecimenReduction(
            (_model(arrays, 1), _model(arrays, 2)),
            tuple((arrays[f"full/{n}"], arrays[f"reduced/{n}"]) for n in (1, 2)),
        )

    def prepare(self, progress: Progress) -> None:
        """Reduce the specimens now, and report the steps to ``progress``."""
        self._progress = progress
        try:
            _ = self.reduction
        finally:
            self._progress = unseen

    def node_count(self) -> int:
        """Return the number of nodes of both bodies, with midside nodes."""
        return self.mesh.node_count(self.case.mesh.order)

    @cached_property
    def pair(self) -> ReducedPair:
        """Both reduced models on the nodes of the pad, with rings held."""
        one, two = (pad_stiffness(model, self.specimen) for model in self.reduction.models)
        return ReducedPair.from_stiffness(self.face, one, two)

    def _reduce(self, modes: int) -> dict[str, Any]:
        """Return all arrays to store in the cache, by name."""
        order, bodies = self.case.mesh.order, (1, 2)
        done = Tally(self._progress, STEPS + len(bodies))
        models = reduced_specimens(
            self.specimen,
            self.mesh,
            self._materials,
            order,
            modes=modes,
            target_distance=self._target,
            done=done,
        )
        arrays: dict[str, Any] = {}
        for number, model in zip(bodies, models, strict=True):
            given = {name: values for name, values in vars(model).items() if values is not None}
            arrays |= {f"{number}/{name}": values for name, values in given.items()}
            assert model.mass is not None
            arrays[f"reduced/{number}"] = _lowest(model.stiffness, model.mass)
            arrays[f"full/{number}"] = self._full_frequencies(number, arrays)
            done()
        return arrays

    def _full_frequencies(self, number: int, known: dict[str, Any]) -> Array:
        """Return frequencies of the finite elements, computed once if both materials are equal."""
        if number == 2 and self._materials[0] == self._materials[1]:
            return known["full/1"]
        body = self.mesh.bodies[number - 1]
        pad = self.face.nodes(number)
        material, order = self._materials[number - 1], self.case.mesh.order
        matrices = specimen_matrices(self.specimen, body, pad, material, order)
        return _lowest(matrices.stiffness, matrices.mass)


def _lowest(stiffness: Any, mass: Any) -> Array:
    """Return the lowest frequencies of a free body above its rigid motions [Hz]."""
    return free_frequencies(stiffness, mass, RIGID_MOTIONS + FREQUENCIES)[RIGID_MOTIONS:]


def _model(arrays: dict[str, Any], number: int) -> ReducedModel:
    prefix = f"{number}/"
    parts = {name.removeprefix(prefix): v for name, v in arrays.items() if name.startswith(prefix)}
    names = tuple(name if isinstance(name, str) else name.decode() for name in parts["names"])
    return ReducedModel(**parts | {"kept": np.asarray(parts["kept"]), "names": names})
