"""Supports and loads of a dovetail joint, condensed onto its two flanks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.cyclic.cuts import Cuts, Cyclic
from fe_models.elasticity.body import ORIGIN, ROTOR, ElasticBody
from fe_models.elasticity.spin_softening import CarriedMass, spin_softening
from fe_models.geometry.dovetail import Dovetail
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Body, MeshError, StructureMesh
from fe_models.meshes.trace import LinearTrace
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody, interface_nodes
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Material

# Boundary of the blade on which the airfoil's pull acts.
TOP = "shank_top"


@dataclass(frozen=True)
class Mission:
    """Load history of one mission: the speed rises linearly to its peak and falls back to zero.

    The pull of the airfoil and the aerodynamic moment follow the square of the speed.

    Attributes
    ----------
    increments
        Number of increments.
    peak_at
        Increment at which the peak speed is reached.
    rotation_speed
        Peak speed [rad/s].
    airfoil_mass
        Mass of the airfoil [t].
    airfoil_radius
        Radius of the airfoil's centre of mass [mm].
    aerodynamic_moment
        Moment about the slot at peak [N mm], which presses on the intrados (X > 0).

    Examples
    --------
    Half of the peak speed after four of eight increments, and a quarter of the forces:

    >>> from fe_models.dovetail import Mission
    >>> mission = Mission(22, 8, 600.0, 0.8e-3, 400.0, 30e3)
    >>> print(mission.speeds()[3], mission.amplitudes()[3, 1])
    300.0 7500.0
    """

    increments: int
    peak_at: int
    rotation_speed: float
    airfoil_mass: float
    airfoil_radius: float
    aerodynamic_moment: float

    def __post_init__(self) -> None:
        increments = checks.whole("increments", self.increments)
        if not 1 <= checks.whole("peak_at", self.peak_at) < increments:
            raise InputError(
                f"the speed peaks at {self.peak_at} of {increments} increments: give 1 or more, "
                "and more increments than that"
            )
        checks.numbers(self, "rotation_speed", above=0.0)
        checks.numbers(self, "airfoil_mass", "airfoil_radius", least=0.0)
        checks.numbers(self, "aerodynamic_moment")

    def speeds(self) -> Array:
        """Return the rotation speed at the end of each increment, ``(increments,)`` [rad/s]."""
        up = np.arange(1, self.peak_at + 1) / self.peak_at
        down = np.arange(self.increments - self.peak_at - 1, -1, -1)
        return self.rotation_speed * np.append(up, down / (self.increments - self.peak_at))

    def amplitudes(self) -> Array:
        """Return the amplitudes ``(increments, 2)`` of the load cases: Ω² [1/s²], moment [N mm]."""
        squares = self.speeds() ** 2
        peak = self.rotation_speed**2
        return np.stack([squares, self.aerodynamic_moment * squares / peak], axis=1)


def dovetail_structure(
    dovetail: Dovetail,
    mesh: StructureMesh,
    disk: Material,
    blade: Material,
    mission: Mission,
    order: int,
    cyclic: bool = False,
) -> Structure:
    """Return the two supported, loaded bodies of a dovetail, disk and blade.

    In the plane all quantities are per length of the slot, and the model is its middle section.

    Parameters
    ----------
    dovetail
        Geometry of the joint.
    mesh
        Its mesh.
    disk, blade
        Materials of the disk and the blade.
    mission
        Speed and loads.
    order
        Order of the elements, 1 or 2.
    cyclic
        Whether the sides of the disk's sector are tied to each other as neighbouring sectors are.
        Otherwise they slide on their planes, which suits a load that is its own mirror image.
    """
    elastic_1, elastic_2 = (
        ElasticBody(body, material, order)
        for body, material in zip(mesh.bodies, (disk, blade), strict=True)
    )

    held = Constraints(len(elastic_1.nodes), elastic_1.dimension)
    held.hold(elastic_1.boundary_nodes("inner"))
    cuts = [dovetail_cuts(dovetail, mesh.bodies[0])] if cyclic else []
    for pair in cuts:
        pair.tie(held, elastic_1)
    if not cuts:
        held.slide(*elastic_1.boundary_normals("sides"))
    centrifugal = elastic_1.centrifugal_load()
    loads_1 = np.stack([centrifugal, np.zeros_like(centrifugal)], axis=1)

    guided = Constraints(len(elastic_2.nodes), elastic_2.dimension)
    if elastic_2.dimension == 3:
        guided.zero_mean(*elastic_2.boundary_weights("root_bottom"), dovetail.slot_direction)
    loads_2 = _blade_loads(elastic_2, dovetail, mission)

    mesh = mesh.weighted(order)
    supported = []
    for number, (elastic, constraints, loads, loaded) in enumerate(
        ((elastic_1, held, loads_1, []), (elastic_2, guided, loads_2, [TOP]))
    ):
        faces = mesh.faces_of(number)
        placed = interface_nodes(faces, elastic.body)
        trace = LinearTrace.of(elastic, {i.name: i.nodes(side) for i, side in faces})
        given = elastic, constraints, *placed, loads
        tied = cuts if number == 0 else []
        supported.append(SupportedBody(*given, loaded=loaded, trace=trace, cuts=tied))
    return Structure(mesh, tuple(supported))


def dovetail_cuts(dovetail: Dovetail, disk: Body) -> Cuts:
    """Return the sides of the disk's sector as cyclic cuts.

    Raises :class:`MeshError` if the slot is skewed: the ends of the sector are planes, so the two
    sides of a skewed sector do not have the same edges.
    """
    if dovetail.skew != 0.0:
        raise MeshError(
            "the slot is skewed, so the sides of the sector are not images of each other; "
            "set the skew to 0, or do without cyclic sides"
        )
    sides = disk.mesh.boundaries["sides"]
    along = disk.outward_of(sides)[:, 0]
    wheel = Cyclic(["the side at X < 0"], ["the side at X > 0"], ROTOR, ORIGIN, dovetail.blades)
    return Cuts.between(disk, wheel, sides[along < 0.0], sides[along > 0.0])


def dovetail_softening(
    structure: Structure, dovetail: Dovetail, mission: Mission
) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Return the spin softening of disk and blade at peak speed, ``(size, size)`` [N/mm].

    The airfoil is rigid and moves with the top of the shank.
    """
    disk, blade = (body.elastic for body in structure.bodies)
    length = dovetail.slot_length if blade.dimension == 2 else 1.0
    centre = mission.airfoil_radius * dovetail.load_axis
    airfoil = CarriedMass(TOP, mission.airfoil_mass / length, centre)
    speed = mission.rotation_speed
    return spin_softening(disk, speed), spin_softening(blade, speed, [airfoil])


def _blade_loads(blade: ElasticBody, dovetail: Dovetail, mission: Mission) -> Array:
    """Return the load cases ``(size, 2)``: rotation at 1 rad/s with the airfoil; a moment."""
    axis = dovetail.load_axis
    length = dovetail.slot_length if blade.dimension == 2 else 1.0
    area = length * blade.boundary_integral(TOP, lambda x: np.ones_like(x[0]))
    lever = length * blade.boundary_integral(TOP, lambda x: _lever(x, dovetail) ** 2)
    pull = mission.airfoil_mass * mission.airfoil_radius / area
    rotation = blade.traction_load(TOP, lambda x: np.full_like(x[0], pull), axis)
    # The moment about the slot is applied as a radial traction that is linear across the shank.
    moment = blade.traction_load(TOP, lambda x: _lever(x, dovetail) / lever, axis)
    return np.stack([rotation + blade.centrifugal_load(), moment], axis=1)


def _lever(points: Array, dovetail: Dovetail) -> Array:
    """Return the distance of points ``(3, ...)`` from the plane through slot and load axis."""
    across = np.cross(dovetail.slot_direction, dovetail.load_axis)
    return np.einsum("a,a...->...", across, points)
