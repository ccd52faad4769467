"""The two specimens of a friction rig: mesh, reduced models and natural frequencies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np

from fe_models.geometry.specimens import Specimen
from fe_models.joints.reduced_contact import ReducedPair
from fe_models.joints.reduction import ReducedModel, free_frequencies
from fe_models.meshes.structure_mesh import Interface, StructureMesh
from fe_models.specimens import STEPS, pad_stiffness, reduced_specimens, specimen_matrices
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Grid, Material, Progress, Tally, unseen
from workflow.models.gaps import AddedGap
from workflow.models.structure_model import NoStore, StructureStore

# Rigid motions of a free body, and number of natural frequencies above them to compare.
RIGID_MOTIONS, FREQUENCIES = 6, 6


@dataclass(frozen=True)
class SpecimenPair:
    """Two equal cylinders end to end, each narrowed to a strip; the strips cross over a pad.

    Parameters
    ----------
    specimen : Specimen
        Dimensions of each specimen (:class:`fe_models.geometry.Specimen`).
    materials : (Material, Material)
        Body 1 and body 2.
    size : float
        Size of the largest elements [mm].
    order : {1, 2}
        Order of the tetrahedra.
    modes : int
        Fixed-interface modes that the reduced model of each specimen keeps.
    added : AddedGap, optional
        Gap on top of the form of the strips, such as measured surfaces.
    target_distance : float, optional
        Distance from the contact of a further point that the reduced models keep [mm].

    Examples
    --------
    The example of :class:`fretscale.FrettedSpecimens` wears such a pair.

    >>> import fretscale
    >>> from fe_models.geometry import Specimen
    >>> from sa_solver import Material
    >>> steel = Material(200e3, 0.3, density=7.8e-9)
    >>> pair = fretscale.SpecimenPair(Specimen(pad_elements=4), (steel, steel), size=4.0)
    >>> print(len(pair.reduced.face))
    25
    """

    specimen: Specimen
    materials: tuple[Material, Material]
    size: float = 1.0
    order: Literal[1, 2] = 2
    modes: int = 20
    added: AddedGap | None = None
    target_distance: float | None = None

    def __post_init__(self) -> None:
        checks.instances(self, specimen=Specimen, added=AddedGap | None)
        checks.numbers(self, "size", "target_distance", above=0.0)
        checks.wholes(self, "modes", least=1)
        checks.wholes(self, "order", least=1, most=2)
        checks.members(self, materials=Material)
        if len(self.materials) != 2 or not all(body.density > 0.0 for body in self.materials):
            raise InputError("materials: give two, each with a density above 0")

    @cached_property
    def reduced(self) -> ReducedSpecimens:
        """The pair with its mesh and its reduced models, which are computed once."""
        return ReducedSpecimens(self)


# A check of a case and the run that follows it share the mesh.
@lru_cache(maxsize=1)
def meshed_specimens(specimen: Specimen, size: float) -> StructureMesh:
    """Return both specimens without added gaps. Raises MeshError."""
    return specimen.mesh(size)


@dataclass(frozen=True)
class SpecimenReduction:
    """Reduced models of body 1 and 2, and natural frequencies of each, free, ``(6,)`` [Hz].

    ``frequencies`` of a body are those of its finite elements and those of its reduced model.
    """

    models: tuple[ReducedModel, ReducedModel]
    frequencies: tuple[tuple[Array, Array], ...]


class ReducedSpecimens:
    """The mesh of a pair of specimens and its reduced models, computed when they are needed.

    The models are found in ``store`` if they are there.
    """

    def __init__(self, model: SpecimenPair, store: StructureStore | None = None) -> None:
        self.model, self._store = model, store or NoStore()
        self._progress: Progress = unseen
        self.from_cache = False

    @cached_property
    def mesh(self) -> StructureMesh:
        """Mesh of both specimens.

        Raises :class:`~fe_models.meshes.structure_mesh.MeshError`.
        """
        model = self.model
        mesh = meshed_specimens(model.specimen, model.size)
        (face,) = mesh.interfaces
        if model.added is not None:
            face = replace(face, gap=face.gap + model.added.at_nodes(face))
        return replace(mesh, interfaces=(face,)).weighted(model.order)

    @property
    def face(self) -> Interface:
        """Interface of the pad."""
        (face,) = self.mesh.interfaces
        return face

    def gap(self, grid: Grid) -> Array:
        """Return the gap of the unloaded, unworn pads on the cells of a grid ``(nx, ny)`` [mm]."""
        gap, added = self.model.specimen.gap(grid.x, grid.y), self.model.added
        return gap if added is None else gap + added.over(grid.x, grid.y)

    @cached_property
    def reduction(self) -> SpecimenReduction:
        """Reduced models and frequencies, from the store if they are there.

        Form and added gaps enter as a gap only, so that all specimens share these models.
        """
        model = self.model
        flat = replace(model.specimen, radii=None)
        further = () if model.target_distance is None else (model.target_distance,)
        key = (flat, model.materials, model.size, model.order, model.modes, *further)
        arrays, self.from_cache = self._store.arrays("specimens", key, self._reduce)
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
        return self.mesh.node_count(self.model.order)

    @cached_property
    def pair(self) -> ReducedPair:
        """Both reduced models on the nodes of the pad, with rings held."""
        one, two = (pad_stiffness(model, self.model.specimen) for model in self.reduction.models)
        return ReducedPair.from_stiffness(self.face, one, two)

    def _reduce(self) -> dict[str, Any]:
        """Return all arrays to store, by name."""
        model, bodies = self.model, (1, 2)
        done = Tally(self._progress, STEPS + len(bodies))
        models = reduced_specimens(
            model.specimen,
            self.mesh,
            model.materials,
            model.order,
            modes=model.modes,
            target_distance=model.target_distance,
            done=done,
        )
        arrays: dict[str, Any] = {}
        for number, body in zip(bodies, models, strict=True):
            given = {name: values for name, values in vars(body).items() if values is not None}
            arrays |= {f"{number}/{name}": values for name, values in given.items()}
            assert body.mass is not None
            arrays[f"reduced/{number}"] = _lowest(body.stiffness, body.mass)
            arrays[f"full/{number}"] = self._full_frequencies(number, arrays)
            done()
        return arrays

    def _full_frequencies(self, number: int, known: dict[str, Any]) -> Array:
        """Return frequencies of the finite elements, computed once if both materials are equal."""
        model = self.model
        if number == 2 and model.materials[0] == model.materials[1]:
            return known["full/1"]
        body = self.mesh.bodies[number - 1]
        pad, material = self.face.nodes(number), model.materials[number - 1]
        matrices = specimen_matrices(model.specimen, body, pad, material, model.order)
        return _lowest(matrices.stiffness, matrices.mass)


def _lowest(stiffness: Any, mass: Any) -> Array:
    """Return the lowest frequencies of a free body above its rigid motions [Hz]."""
    return free_frequencies(stiffness, mass, RIGID_MOTIONS + FREQUENCIES)[RIGID_MOTIONS:]


def _model(arrays: dict[str, Any], number: int) -> ReducedModel:
    prefix = f"{number}/"
    parts = {name.removeprefix(prefix): v for name, v in arrays.items() if name.startswith(prefix)}
    names = tuple(name if isinstance(name, str) else name.decode() for name in parts["names"])
    return ReducedModel(**parts | {"kept": np.asarray(parts["kept"]), "names": names})
