"""Layout and contents of a wear run's ``results.h5``."""

from __future__ import annotations

from dataclasses import dataclass

from workflow.analyses.contact.output.layout import LOAD_HISTORY, ON_GRID, TRACTIONS
from workflow.analyses.wear.output.loop_table import OVER_ENERGY
from workflow.layout.declared import GRID, Layout
from workflow.models.budget.names import PARTS, PRESSURES, WORN
from workflow.models.stress.layout import BODY, LIFE, SECTION, SECTION_AXES

# Ratio of the cycles to which kinetics are extrapolated to the computed cycles.
EXTRAPOLATION = 2.0
# Results with estimated errors, by name and in words: wear, pressures, and others.
RESULTS = WORN | PRESSURES | {"life": "fretting parameter", "notch_stress": "notch stress"}
# Group of the face of body 1, below that of the contact, which is the face of body 2.
OTHER_FACE = "face_1"
FACE_MESH = """
    coordinates | mm | {node} component | nodes in the interface frame
    facets | 1 | {facet} corner | corner nodes of triangles, or of segments of a line contact
"""
FACE = f"""{FACE_MESH.format(node="node", facet="facet")}
    {TRACTIONS.format(cells="increment node", vectors="increment component node")}
    force | N | increment axis node | force of body 1 on body 2 at the nodes, x, y and z
    displacement | mm | increment axis node | motion of body 2 relative to body 1 since both were
        unloaded and unworn, x, y and z
"""
CYCLES = """
    cycles | 1 | cycles | cycles computed so far
"""
KINETICS = """
    depth_1, depth_2 | mm | cycles | largest worn depth of body #
    volume_1, volume_2 | mm^3 | cycles | worn volume of body #
    energy | N mm | cycles | energy dissipated so far
    area | mm^2 | cycles | area in contact
"""
_ERROR = f"""1 | part | estimated relative errors by {", ".join(PARTS)},
        above 0 where the result is too large, and their total"""
LAYOUT = Layout.read(
    f"""
grid/<face>{GRID}
structure/<face>, structure_worn/<face>{FACE}
structure/<face>/load_history, structure_worn/<face>/load_history{LOAD_HISTORY}
structure/<face>/{OTHER_FACE}, structure_worn/<face>/{OTHER_FACE}
    {FACE_MESH.format(node="node_1", facet="facet_1")}
surfaces/<face>/<jump>
    body_1, body_2 | mm | x y | height of body # in the interface frame
contact/<face>
    energy_half_space | N mm | increment | energy dissipated in each increment, half-space pressure
    energy_nodes | N mm | increment | energy dissipated in each increment, nodal pressure
    Mx_unworn, Mx_worn | N mm | increment | moment of the pressure about x that holds the tilt, #
    My_unworn, My_worn | N mm | increment | moment of the pressure about y that holds the tilt, #
contact/<face>/coarse{GRID}
    pressure | MPa | x y | contact pressure
contact/<face>/<jump>{ON_GRID}
comparison/<face>/load_history{LOAD_HISTORY}
comparison/<face>/<increment>{ON_GRID}
kinetics{CYCLES}
kinetics/<face>{KINETICS}
loops/<face>/<jump>
    displacement | mm | point | motion of body 1 relative to body 2 along the axis, from
        the pressed state
    force | N | point | tangential force on body 2
loops_over_energy/<face>
    {OVER_ENERGY}
bolts/<bolt>
    tension | N | cycles | tension at peak load after each jump, as the loads were last solved
    tension_unworn, tension_worn | N | increment | tension in each increment, of the meshed part, #
bodies/<body>/error
    notch_stress | {_ERROR}
bodies/<body>/<moment>{BODY}
bodies/<body>/<moment>/notch
    points | mm | notch_vertex axis | vertices of the local model of the notch
    elements | 1 | notch_element corner | corner vertices of its tetrahedra, or triangles in the
        plane
    displacement | mm | notch_vertex axis | displacement at peak load
    stress | MPa | stress_component notch_vertex | xx, yy, zz, xy, yz, zx of the global axes at
        peak load
    von_mises | MPa | notch_vertex | von Mises stress at peak load
    maximum_principal | MPa | notch_vertex | largest principal stress at peak load
bodies/<body>/<moment>/mission
    increments | 1 | increments | increments, counted from 1
    points | mm | surface_vertex axis | vertices of the surface, or of the whole body in the plane
    triangles | 1 | triangle triangle_corner | triangles of the surface, or of the body in the plane
    displacement | mm | increments surface_vertex axis | displacement in each increment
    von_mises | MPa | increments surface_vertex | von Mises stress in each increment
    maximum_principal | MPa | increments surface_vertex | largest principal stress in each increment
stress/section/<face>{SECTION_AXES}
stress/section/<face>/<moment>/<body>{SECTION}
stress/life/<face>/<moment>
    left_out | 1 | left_out_increment | increments whose shear is not fully known, not in the map
stress/life/<face>/<moment>/<body>{LIFE}
error/<face>
    {", ".join(RESULTS)} | {_ERROR}
""",
    x="grid/<face>",
    y="grid/<face>",
    cycles="kinetics",
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
    the increments; the bodies ``notches`` have local models. ``nodes`` says that its nodes wear
    instead of half-spaces. ``coarse`` are the interfaces with a solution on a coarse grid. The case
    may request a ``comparison`` of half-space
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
    notches: tuple[str, ...] = ()
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
