"""What a wear run's ``results.h5`` holds, for those who draw it."""

from __future__ import annotations

from dataclasses import dataclass

MOMENTS = "unworn", "worn"
# How far kinetics are extended, in computed numbers of cycles.
EXTRAPOLATION = 2.0
# What leaves errors, in the order of their datasets.
PARTS = ("link", "mesh", "increments", "grid", "steps", "coupling", "solver")
# Results that have errors, by their names and in words: what is worn, pressures, and the rest.
WORN = {"depth": "depth", "volume": "volume"}
PRESSURES = {
    "peak_pressure": "unworn peak pressure",
    "worn_peak_pressure": "worn peak pressure",
}
RESULTS = WORN | PRESSURES | {"life": "fretting parameter", "notch_stress": "notch stress"}


def energy_name(nodes: bool) -> str:
    """The energies dissipated in a cycle by what wears: nodes, or a half-space."""
    return "energy_nodes" if nodes else "energy_half_space"


def jump_name(number: int) -> str:
    """The group of a jump, below that of its interface."""
    return f"{number:05d}"


@dataclass(frozen=True)
class Contents:
    """What is there beside loads, contact, surfaces and kinetics of the interfaces ``names``.

    ``bodies`` are the names of body 1 and 2, ``jumps`` how many there are beside the unworn state.
    ``line`` contacts have forces and energies per length, a ``mix`` of missions has the share of
    each; ``dissipation`` says whether the loads tell what they dissipate; ``bolts`` are the names
    of those that the loads tighten. A ``structure`` of finite
    elements gives tractions at its nodes, and all bodies unworn and worn, with ``mission`` over
    the increments too; its ``nodes`` wear, or half-spaces. ``coarse`` are the interfaces with a
    solution on a coarse grid. The rest is there where a case asks for it: a ``comparison`` of
    half-space and structure, tangential ``loops``, ``sections`` of the stress under the contacts,
    and the interfaces with maps of fretting ``life``, of which only those ``cracking`` are above 0
    anywhere; the bodies ``strained`` have such stresses, a rigid one has none. ``worn`` says
    whether anything has been lost.
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
        """Unworn and worn, each with its jump: both with the only one where nothing wore."""
        names = self.jump_names
        return [("unworn", names[0]), ("worn", names[-1])]

    @property
    def states(self) -> list[tuple[str, str]]:
        """The same, but one of each: unworn alone where nothing wore."""
        return self.ends if self.jumps else self.ends[:1]

    @property
    def wears(self) -> str:
        """What wears, in words."""
        return "nodes" if self.nodes else "half-space"

    @property
    def loads(self) -> str:
        """Where the loads are from, in words."""
        return "finite elements" if self.structure else "imposed loads"

    @property
    def per(self) -> str:
        """What units of forces and energies end in."""
        return "/mm" if self.line else ""
