"""Contents of a wear run's ``results.h5``, for the code that draws it."""

from __future__ import annotations

from dataclasses import dataclass

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
