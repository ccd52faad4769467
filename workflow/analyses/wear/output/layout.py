"""Layout and contents of a wear run's ``results.h5``."""

from __future__ import annotations

from dataclasses import dataclass

from workflow.analyses.contact.output.layout import LOAD_HISTORY, TRACTIONS
from workflow.analyses.wear.output.loop_table import COLUMNS
from workflow.layout.declared import CELLS, GRID, Declarations, Declared, Layout, over

MOMENTS = "unworn", "worn"
# Ratio of the cycles to which kinetics are extrapolated to the computed cycles.
EXTRAPOLATION = 2.0
# Sources of error, in the order of their datasets.
PARTS = ("link", "mesh", "increments", "grid", "steps", "coupling", "solver")
# Results with estimated errors, by name and in words: wear, pressures, and others.
WORN = {"depth": "depth", "volume": "volume"}
PRESSURES = {
    "peak_pressure": "unworn peak pressure",
    "worn_peak_pressure": "worn peak pressure",
}
RESULTS = WORN | PRESSURES | {"life": "fretting parameter", "notch_stress": "notch stress"}
# Group of the face of body 1, below that of the contact, which is the face of body 2.
OTHER_FACE = "face_1"
# Quantities of tangential loops that are written over the energy.
OVER_ENERGY = "energy", "kt", "kt_error", "mu", "mu_error"
_BULK = "what the structure carries past the contact included where the group says bulk_stress"


def face_mesh(node: str = "node", facet: str = "facet") -> Declarations:
    """Return nodes and facets of a face; in a line contact the facets are segments."""
    facets = "corner nodes of the triangles, or of the segments of a line contact"
    return {
        **over(f"{node} component", coordinates=("mm", "nodes in the interface frame")),
        **over(f"{facet} corner", facets=("1", facets)),
    }


FACE = {
    **face_mesh(),
    "slip": TRACTIONS["slip"]._replace(dims=("increment", "component", "node")),
    "pressure": TRACTIONS["pressure"]._replace(dims=("increment", "node")),
    "shear": TRACTIONS["shear"]._replace(dims=("increment", "component", "node")),
    **over(
        "increment axis node",
        force=("N", "of body 1 on body 2 at the nodes, x, y and z"),
        displacement=(
            "mm",
            "of body 2 relative to body 1 since both were unloaded and unworn, x, y and z",
        ),
    ),
}
CYCLES = over("cycles", cycles=("1", "cycles"))
KINETICS = over(
    "cycles",
    depth_1=("mm", "largest worn depth of body 1"),
    depth_2=("mm", "largest worn depth of body 2"),
    volume_1=("mm^3", "worn volume of body 1"),
    volume_2=("mm^3", "worn volume of body 2"),
    energy=("N mm", "energy dissipated so far"),
    area=("mm^2", "area in contact"),
)
_TENSION = "tension of the bolt in each increment, as far as it is meshed"
_ENERGY = "energy dissipated in each increment"
_FACES = {
    "": FACE,
    "/load_history": LOAD_HISTORY,
    f"/{OTHER_FACE}": face_mesh("node_1", "facet_1"),
}
_ERROR = Declared(
    "1",
    f"estimated relative errors by {', '.join(PARTS)}, above 0 where too much is told, and "
    "their total",
    ("part",),
)
LAYOUT = Layout(
    {
        "grid/<face>": GRID,
        **{f"structure/<face>{place}": face for place, face in _FACES.items()},
        **{f"structure_worn/<face>{place}": face for place, face in _FACES.items()},
        "surfaces/<face>/<jump>": over(
            CELLS,
            body_1=("mm", "height of body 1 in the interface frame"),
            body_2=("mm", "height of body 2 in the interface frame"),
        ),
        "contact/<face>": {
            **over(
                "increment",
                energy_half_space=("N mm", f"{_ENERGY}, half-space pressure"),
                energy_nodes=("N mm", f"{_ENERGY}, nodal pressure"),
            ),
            **{
                f"{name}_{when}": LOAD_HISTORY[name]._replace(
                    description=f"{LOAD_HISTORY[name].description} that holds the tilt, {when}"
                )
                for name in ("Mx", "My")
                for when in MOMENTS
            },
        },
        "contact/<face>/coarse": {**GRID, "pressure": TRACTIONS["pressure"]},
        "contact/<face>/<jump>": TRACTIONS,
        "comparison/<face>/load_history": LOAD_HISTORY,
        "comparison/<face>/<increment>": TRACTIONS,
        "kinetics": CYCLES,
        "kinetics/<face>": KINETICS,
        "loops/<face>/<jump>": over(
            "point",
            displacement=(
                "mm",
                "of body 1 relative to body 2 along the axis, from the pressed state",
            ),
            force=("N", "tangential force on body 2"),
        ),
        "loops_over_energy/<face>": {
            column.name: Declared(
                column.units(per_length=False)[0].replace("*", " "),
                column.description,
                ("energy",),
                line_unit=column.units(per_length=True)[0].replace("*", " "),
            )
            for column in COLUMNS
            if column.name in OVER_ENERGY
        },
        "bolts/<bolt>": {
            **over(
                "cycles",
                tension=(
                    "N",
                    "tension at peak load after each jump, as the loads were last solved",
                ),
            ),
            **over(
                "increment",
                tension_unworn=("N", f"{_TENSION}, unworn"),
                tension_worn=("N", f"{_TENSION}, worn"),
            ),
        },
        "bodies/<body>/error": {"notch_stress": _ERROR},
        "bodies/<body>/<moment>": {
            **over("vertex axis", points=("mm", "vertices, the faces of body 2 in their form")),
            **over(
                "element corner",
                elements=(
                    "1",
                    "corner vertices of the tetrahedra, or of the triangles in the plane",
                ),
            ),
            **over("vertex axis", displacement=("mm", "displacement at peak load")),
            **over(
                "stress_component vertex",
                stress=("MPa", "stress xx, yy, zz, xy, yz, zx of the global axes at peak load"),
            ),
            **over(
                "vertex",
                von_mises=("MPa", "von Mises stress at peak load"),
                maximum_principal=("MPa", "largest principal stress at peak load"),
            ),
        },
        "bodies/<body>/<moment>/mission": {
            **over("increments", increments=("1", "increments, counted from 1")),
            **over(
                "surface_vertex axis",
                points=("mm", "vertices of the surface of the body, or of all of it in the plane"),
            ),
            **over(
                "triangle triangle_corner",
                triangles=(
                    "1",
                    "triangles of the surface of the body, or of all of it in the plane",
                ),
            ),
            **over(
                "increments surface_vertex axis",
                displacement=("mm", "displacement in each increment"),
            ),
            **over(
                "increments surface_vertex",
                von_mises=("MPa", "von Mises stress in each increment"),
                maximum_principal=("MPa", "largest principal stress in each increment"),
            ),
        },
        "stress/section/<face>": {
            **over("along", along=("mm", "centres of the section's cells, along its axis")),
            **over("depths", depths=("mm", "of the section's points below the surface")),
        },
        "stress/section/<face>/<moment>/<body>": {
            **over(
                "stress_component along depths",
                stress=("MPa", f"xx, yy, zz, xy, yz, zx in the section at peak load, {_BULK}"),
            ),
            **over("along depths", von_mises=("MPa", "von Mises stress at peak load")),
        },
        "stress/life/<face>/<moment>": over(
            "left_out_increment",
            left_out=("1", "increments without full knowledge of the shear, not in the life map"),
        ),
        "stress/life/<face>/<moment>/<body>": {
            **over(
                CELLS,
                friction_parameter=(
                    "N/mm",
                    "Ruiz's F1: a quarter of the friction work of a cycle per area",
                ),
                tension=("MPa", f"largest tension along the surface over a cycle, {_BULK}"),
                cracking_parameter=("N^2/mm^3", "Ruiz's F2: F1 times tension"),
                smith_watson_topper=(
                    "MPa",
                    "largest normal stress times strain amplitude, worst plane",
                ),
                strain_amplitude=("1", "amplitude of the normal strain on the worst plane"),
                findley=("MPa", "shear stress amplitude plus k largest normal stress, worst plane"),
                shear_amplitude=("MPa", "amplitude of the shear stress on the worst plane"),
                normal_stress=(
                    "MPa",
                    f"largest normal stress over a cycle on the worst plane, {_BULK}",
                ),
            ),
            **over(
                f"axis {CELLS}",
                normal=("1", "unit normal of the worst plane, in the interface frame"),
            ),
        },
        "error/<face>": dict.fromkeys(RESULTS, _ERROR),
    },
    coordinates={**dict.fromkeys(GRID, "grid/<face>"), "cycles": "kinetics"},
)


def energy_name(nodes: bool) -> str:
    """Return the dataset of energy per cycle, dissipated at nodes or by a half-space."""
    return "energy_nodes" if nodes else "energy_half_space"


def jump_name(number: int) -> str:
    """Return the group of a jump, below that of its interface."""
    return f"{number:05d}"


@dataclass(frozen=True)
class WearContents:
    """Optional contents of the results; loads, contact, surfaces and kinetics are always there.

    ``names`` are the interfaces and ``bodies`` the names of body 1 and body 2. ``jumps`` is their
    number without the unworn state. ``line`` contacts have forces and energies per length; a
    ``mix`` of missions has the share of each. ``dissipation`` says whether the loads include
    dissipated energy. ``bolts`` are the names of the bolts that the loads tighten. A finite element
    ``structure`` has nodal tractions and all bodies unworn and worn, with a ``mission`` also over
    the increments; ``nodes`` says that its nodes wear instead of half-spaces. ``coarse`` are the
    interfaces with a solution on a coarse grid. The case may request a ``comparison`` of half-space
    and structure, tangential ``loops``, ``sections`` of the stress under the contacts, and maps of
    fretting ``life`` for the named interfaces; only the ``cracking`` ones are above 0 anywhere. The
    ``strained`` bodies have such stresses; a rigid body has none. ``worn`` says whether anything
    has worn.
    """

    names: tuple[str, ...]
    bodies: tuple[str, str]
    jumps: int
    line: bool = False
    mix: bool = False
    dissipation: bool = True
    structure: bool = False
    mission: bool = False
    nodes: bool = False
    bolts: tuple[str, ...] = ()
    coarse: tuple[str, ...] = ()
    comparison: bool = False
    loops: bool = False
    sections: bool = False
    life: tuple[str, ...] = ()
    cracking: tuple[str, ...] = ()
    strained: tuple[int, ...] = (1, 2)
    worn: bool = True

    @property
    def jump_names(self) -> list[str]:
        """Groups of all jumps, the unworn state first."""
        return [jump_name(number) for number in range(self.jumps + 1)]

    @property
    def ends(self) -> list[tuple[str, str]]:
        """Unworn and worn state with their jumps, which are the same if nothing wore."""
        names = self.jump_names
        return [("unworn", names[0]), ("worn", names[-1])]

    @property
    def states(self) -> list[tuple[str, str]]:
        """Distinct states of :attr:`ends`: only the unworn one if nothing wore."""
        return self.ends if self.jumps else self.ends[:1]

    @property
    def wears(self) -> str:
        """The worn model, in words."""
        return "nodes" if self.nodes else "half-space"

    @property
    def loads(self) -> str:
        """The origin of the loads, in words."""
        return "finite elements" if self.structure else "imposed loads"

    @property
    def per(self) -> str:
        """Suffix of the units of forces and energies."""
        return "/mm" if self.line else ""
