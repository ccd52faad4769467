"""Description of a structure of finite elements, and where its condensed parts are stored."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from fe_models.elasticity.local_model import LocalModel
from fe_models.elasticity.relinearised import Softening
from fe_models.joints.condensation import Condensed
from fe_models.joints.face_traction import FaceTraction
from fe_models.joints.joint import Resolvent
from fe_models.loads.pretension import Bolt
from fe_models.meshes.structure_mesh import Interface, StructureMesh
from fe_models.structure import CycleSolution, Structure
from sa_solver.types import Array, Indices
from workflow.messages.warning_kinds import WarningKind
from workflow.models.loads import ContactFace


@dataclass(frozen=True)
class LoadCycle:
    """One closed cycle of the loads of a structure, such as a mission.

    Parameters
    ----------
    amplitudes : array (t, cases)
        Amplitudes of the load cases at the end of each increment.
    preload : array (s, cases)
        Amplitudes on the way to the first cycle, such as tightened bolts.
    share : float
        Share of all cycles that are like this one.
    """

    amplitudes: Array
    preload: Array
    share: float = 1.0


@dataclass(frozen=True)
class Nonlinearity:
    """Geometric nonlinearity of a structure that is taken into account.

    Parameters
    ----------
    stiffness : {"linear", "stress_stiffened", "relinearised"}
        Stiffness of the bodies: linear; with the stress and spin of peak load; or the tangent of
        the nonlinear structure there.
    check : bool
        Whether to compare with a total Lagrangian model at peak load, which takes two more
        condensations.
    """

    stiffness: Literal["linear", "stress_stiffened", "relinearised"] = "linear"
    check: bool = False


class Remark(NamedTuple):
    """A remark about a structure: a warning of a kind, or something worth knowing without one."""

    text: str
    kind: WarningKind | None = None


@dataclass(frozen=True)
class FinerMesh:
    """A ``structure`` on a finer mesh than another.

    The error due to the other mesh is ``share`` times the difference of their results.
    """

    structure: StructureModel
    share: float = 1.0


class MeshesAlongSlot(NamedTuple):
    """A structure with few nodes across its faces, on two meshes for probe runs.

    ``own`` has as many nodes along the slot as the structure, ``other`` about half or twice as
    many. The error due to this number is ``share`` times the difference of their results.
    """

    own: StructureModel
    other: StructureModel
    share: float


class StructureModel(Protocol):
    """A structure of finite elements: its mesh, loads, supports and contact faces.

    Attributes
    ----------
    key
        Everything that the condensed joint depends on; equal keys mean equal joints.
    load_cycles
        Closed cycles of the loads: one, unless several take turns.
    peak
        Increment of peak load, counted from 0 over all load cycles.
    order
        Order of the elements.
    tightening
        Number of increments that tighten the bolts; 0 without bolts.
    nonlinearity
        Geometric nonlinearity that is taken into account.
    finer
        Advice on how to refine the mesh, for messages.
    """

    @property
    def key(self) -> tuple[object, ...]: ...
    @property
    def load_cycles(self) -> tuple[LoadCycle, ...]: ...
    @property
    def peak(self) -> int: ...
    @property
    def order(self) -> Literal[1, 2]: ...
    @property
    def tightening(self) -> int: ...
    @property
    def nonlinearity(self) -> Nonlinearity: ...
    @property
    def finer(self) -> str: ...

    def softening(self, structure: Structure) -> Softening:
        """Return the spin softening of all bodies at peak load."""
        ...

    def meshed(self) -> StructureMesh:
        """Return the unworn mesh."""
        ...

    def structure(self, mesh: StructureMesh) -> Structure:
        """Return all bodies with supports and loads, on the unworn or a worn mesh."""
        ...

    def bolts(self, structure: Structure) -> tuple[Bolt, ...]:
        """Return the bolts that the loads tighten."""
        ...

    def contact_face(self, interface: Interface) -> ContactFace:
        """Return the contact face of an interface."""
        ...

    def node_numbers(self, place: int) -> Indices | None:
        """Return the user's numbers of a body's vertices, or None where the mesh is generated.

        ``place`` is the body's place among those of the mesh.
        """
        ...

    def section(self) -> StructureModel | None:
        """Return a plane section that represents the structure in probe runs, if there is one."""
        ...

    def finer_mesh(self) -> FinerMesh | None:
        """Return the structure on a finer mesh for probe runs, or None without a cheap one."""
        ...

    def along_slot(self) -> MeshesAlongSlot | None:
        """Return the structure on two meshes that differ along the slot, or None without a slot."""
        ...

    def notch_models(
        self, tractions: Sequence[FaceTraction], amplitudes: Array
    ) -> list[list[LocalModel | None]] | None:
        """Return local models of the notches by body and by state, or None if they are not cheap.

        Contact ``tractions`` and ``amplitudes`` of the load cases ``(k, cases)`` are those of ``k``
        states.
        """
        ...

    def remarks(self, structure: Structure, friction: Sequence[float]) -> Iterable[Remark]:
        """Return remarks on this structure and friction for the user."""
        ...


class StructureStore(Protocol):
    """Storage of condensed structures and their unworn cycles between runs."""

    def body(self, made_from: Sequence[np.ndarray], make: Callable[[], Condensed]) -> Condensed:
        """Return the condensed body made from these arrays; ``make`` it if it is not stored."""
        ...

    def joint(
        self, key: tuple[object, ...], make: Callable[[], Resolvent]
    ) -> tuple[Resolvent, bool]:
        """Return the condensed joint of a key, and whether it was stored."""
        ...

    def cycle(
        self,
        key: tuple[object, ...],
        structure: Structure,
        friction: float | Array,
        make: Callable[[], CycleSolution],
    ) -> CycleSolution:
        """Return the solved cycle of a key on its structure."""
        ...

    def arrays(
        self, kind: str, key: tuple[object, ...], make: Callable[[], dict[str, Any]]
    ) -> tuple[dict[str, Any], bool]:
        """Return the named arrays of a kind and key, and whether they were stored."""
        ...


class NoStore:
    """A store without contents: everything is computed anew."""

    def body(self, made_from: Sequence[np.ndarray], make: Callable[[], Condensed]) -> Condensed:
        return make()

    def joint(
        self, key: tuple[object, ...], make: Callable[[], Resolvent]
    ) -> tuple[Resolvent, bool]:
        return make(), False

    def cycle(
        self,
        key: tuple[object, ...],
        structure: Structure,
        friction: float | Array,
        make: Callable[[], CycleSolution],
    ) -> CycleSolution:
        return make()

    def arrays(
        self, kind: str, key: tuple[object, ...], make: Callable[[], dict[str, Any]]
    ) -> tuple[dict[str, Any], bool]:
        return make(), False
