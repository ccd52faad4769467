"""Base of all wear cases: contacts with friction that wear under one cycle of loads."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, isfinite, sqrt
from typing import Any, ClassVar, Literal, Self

from pydantic import model_validator

from sa_solver.types import Material as ElasticMaterial
from workflow.analyses.wear.case.evolution import EvolvingFriction
from workflow.analyses.wear.case.loops import Loops
from workflow.analyses.wear.case.scanned import WithScans
from workflow.analyses.wear.case.sections import (
    BodiesThatWear,
    ContactSection,
    ContactStress,
    Coupling,
    NonlinearitySection,
    Ratio,
)
from workflow.analyses.wear.case.worn_bodies import Worn, wearing
from workflow.case.fields import shown
from workflow.case.plausibility import idle_steps, uneven_cells
from workflow.case.sections import Case, Section, Title, disagreement, entry
from workflow.case.text.plain import entries, listed, of_bodies, plain, shares, times
from workflow.messages.warning_kinds import Notice
from workflow.models.checks.limits import unstable_fraction
from workflow.models.checks.names import is_group_name

# Names of the entries of summary and results, which interfaces must not have.
RESERVED = (
    *("title", "assumed", "per_length", "cycles", "jumps", "work", "structure", "kinetics"),
    *("surfaces", "warnings", "seconds", "versions", "choice"),
)
# Tolerance of the contact solver over the accuracy: its error is then negligible.
SOLVED = 1e-3
# For automatic increments: the number per leg that leaves an error of about 1 %, from seven
# dovetails, and the largest number ever chosen for a cycle.
EXPECTED_INCREMENTS, MOST_INCREMENTS = 11, 1000


def check_interface_name(name: str, key: str) -> None:
    """Refuse, at ``key``, an interface whose name cannot be used in the results."""
    if name in RESERVED or not is_group_name(name):
        raise disagreement(
            f"an interface called {shown(name)}; allowed: a name without /, other than "
            f"{', '.join(RESERVED)}",
            key,
        )


@dataclass(frozen=True)
class ContactTerms:
    """Materials and wear laws of body 1 and body 2, friction and grid of one contact of a case."""

    materials: tuple[ElasticMaterial, ElasticMaterial]
    laws: tuple[Worn, Worn]
    friction: EvolvingFriction
    grid: tuple[int, int]

    @property
    def strained(self) -> tuple[Literal[1, 2], ...]:
        """Numbers of the bodies that have strains and stresses: all but a rigid one."""
        bodies: tuple[Literal[1, 2], ...] = (1, 2)
        return tuple(n for n in bodies if isfinite(self.materials[n - 1].young))


class WearCase(WithScans, Case):
    """Case of a wear run: the source of its loads, its contacts and how they wear.

    Each kind of structure narrows the types of ``structure``, ``materials`` and ``wear``.
    """

    # Names of body 1 and body 2 (sa_solver.types) in the sections that distinguish them.
    bodies: ClassVar[tuple[str, str]] = ("body_1", "body_2")
    # Whether both bodies are true half-spaces; for other structures half-spaces are a model.
    half_spaces: ClassVar[bool] = False

    title: Title = entry("one line", "Ti-6Al-4V dovetail, one mission per cycle")
    analysis: Literal["wear"] = entry("kind of analysis", "wear")
    structure: Section = entry("loaded structure")
    materials: Section = entry("the two bodies in contact")
    friction: EvolvingFriction = entry("Coulomb's law on every contact face")
    contact: ContactSection = entry(
        "half-space grid over each contact face", default=ContactSection()
    )
    wear: BodiesThatWear = entry("law, length of the run and step")
    loops: Loops = entry(
        "tangential loops on the worn contacts, if amplitude or force is given", default=Loops()
    )
    stress: ContactStress = entry(
        "stress under the contacts, unworn and worn", default=ContactStress()
    )
    accuracy: Ratio = entry(
        "accuracy of the main results: a run warns of those whose estimated error is larger, and "
        "of pressure and fretting parameter at worn edges if it is five times as large [1]",
        "5 %",
        default=0.05,
    )
    error_budget: Literal["probed", "known"] = entry(
        "probed: short probe runs on a finer mesh and a coarser grid estimate the errors of "
        "these; known: only what the run itself knows",
        "probed",
        default="probed",
    )

    @property
    def contact_tolerance(self) -> float:
        """Relative tolerance of the contact solver."""
        given = self.contact.tolerance
        return SOLVED * self.accuracy if given is None else given

    def material(self, number: int) -> ElasticMaterial:
        """Return the material of body ``number``, 1 or 2."""
        material: ElasticMaterial = getattr(self.materials, self.bodies[number - 1]).elastic()
        return material

    def terms(self, name: str) -> ContactTerms:
        """Return the terms of the named contact; all are equal unless a structure overrides it."""
        return ContactTerms(
            materials=(self.material(1), self.material(2)),
            laws=(self.wear_of(1), self.wear_of(2)),
            friction=self.friction,
            grid=self.contact.grid,
        )

    @property
    def contact_names(self) -> tuple[str, ...]:
        """One name per distinct contact: a name stands for all contacts with equal terms."""
        return ("",)

    @property
    def every_terms(self) -> list[ContactTerms]:
        """Terms of all :attr:`contact_names`."""
        return [self.terms(name) for name in self.contact_names]

    def contact_of(self, name: str) -> ContactSection:
        """Return the section ``contact`` with the grid of the contact of that name."""
        return self.contact.model_copy(update={"grid": self.terms(name).grid})

    @property
    def friction_evolves(self) -> bool:
        """True if friction of any contact changes as it wears."""
        return any(terms.friction.evolution is not None for terms in self.every_terms)

    def on_one_grid(self) -> Self:
        """Return the case with all its contacts on ``contact.grid``."""
        return self

    def wear_of(self, number: int) -> Worn:
        """Return the wear law of body ``number``, 1 or 2."""
        worn: Worn = getattr(self.wear, self.bodies[number - 1])
        return worn

    @model_validator(mode="after")
    def _nodes_can_wear(self) -> WearCase:
        """Refuse settings that wear of the mesh's nodes does not support."""
        if self.contact.method != "nodes":
            return self
        if not isinstance(self, FiniteElementCase):
            raise disagreement("nodes: without a mesh; allowed: normal, full", "contact.method")
        terms = self.every_terms
        evolutions = [getattr(law, "evolution", None) for each in terms for law in each.laws]
        worn_by_all = any(e is not None and e.scope == "global" for e in evolutions)
        mixed = bool(getattr(getattr(self, "load_path", None), "mix", ()))
        wrong = {
            "wear.step.kind": (self.wear.step.kind != "second_order", "second_order"),
            "wear.motion": (self.wear.motion == "follow", "auto, neglect"),
            "wear": (worn_by_all, "evolution with scope: local"),
            "friction.evolution": (self.friction_evolves, "leave it out"),
            "structure.contacts": (
                len({each.laws for each in terms}) > 1,
                "one wear law for all contacts, that of wear",
            ),
            "load_path.mix": (mixed, "one mission"),
            "loops": (self.loops.wanted, "leave them out: the bodies are half-spaces"),
            "fidelity": (getattr(self, "fidelity", "fixed") != "fixed", "fixed"),
        }
        for key, (given, allowed) in wrong.items():
            if given:
                raise disagreement(
                    f"not available where nodes wear (contact.method: nodes); allowed: {allowed}",
                    key,
                )
        return self

    @property
    @abstractmethod
    def loads_in_words(self) -> str:
        """Loads of a cycle, as one line of text."""

    @property
    def question(self) -> str:
        bodies = listed([name.replace("_", " ") for name in self.bodies])
        return (
            f"How far do {bodies} wear in {times(self.wear.cycles)} cycles, and how does that "
            f"change the contact pressure? Load: {self.loads_in_words}."
        )

    @abstractmethod
    def loads_outline(self) -> list[tuple[str, str]]:
        """Return structure and loads of the run in a few rows of name and text."""

    def outline(self) -> list[tuple[str, str]]:
        grid, wear = self.contact.grid, self.wear
        plane = getattr(self.structure, "dimension", 3) == 2 or grid[1] == 1
        cells = f"{grid[0]} cells" if plane else f"{grid[0]} x {grid[1]} cells"
        steps = f"{wear.step.kind} steps, {wear.step_size}"
        changes = "" if self.friction.evolution is None else ", changing with dissipated energy"
        sides = self.face_sides()
        pitch = [] if sides is None else [s / n for s, n in zip(sides, grid, strict=True)]
        of = " x ".join(plain(size, "mm", 4) for size in pitch[: 1 if plane else 2])
        return [
            *self.loads_outline(),
            *of_bodies("material", self.materials),
            ("friction", f"{self.friction.coefficient:g}{changes}"),
            ("contact", f"{cells}{f' of {of}' if of else ''}, method {self.contact.method}"),
            *wearing({name: self.wear_of(n) for n, name in enumerate(self.bodies, 1)}),
            ("wear", f"{times(wear.cycles)} cycles, {steps}"),
            *(
                [("loops", f"{self.loops.axis}, {entries(self.loops)}")]
                if self.loops.wanted
                else []
            ),
        ]

    def face_sides(self) -> tuple[float, float] | None:
        """Return the extent of the contact grid along x and y [mm], None if only a mesh has it."""
        return None

    def plausibility_warnings(self) -> Iterator[Notice]:
        yield from idle_steps("wear.step.cycles", self.wear.step.cycles, self.wear.cycles)
        for kind, text in unstable_fraction(self.wear.step.fraction):
            yield Notice(kind, f"wear.step.fraction: {text}")
        if (sides := self.face_sides()) is not None:
            yield from uneven_cells(sides, self.contact.grid)

    @property
    def yields(self) -> list[float | None]:
        """Yield stresses of the bodies that have one [MPa]."""
        bodies = [getattr(self.materials, name) for name in self.bodies]
        return [getattr(body, "yield_stress", None) for body in bodies]

    @property
    def recoupling(self) -> Coupling:
        """Settings for updating the loads with worn surfaces: never, without a structure."""
        return Coupling(resultants="constant")


class FiniteElementCase(WearCase):
    """Case whose loads come from a finite element structure."""

    nonlinearity: NonlinearitySection = entry(
        "geometric nonlinearity of the structure", default=NonlinearitySection()
    )
    coupling: Coupling = entry("return of worn surfaces to the structure", default=Coupling())

    def remarks_on_nodes(self) -> Iterator[str]:
        """Yield remarks on measured surfaces with more detail than the nodes can follow."""
        half_space = "the half-space resolves what its grid does"
        yield from self.finer_than_nodes(
            "only the nodes are known" if self.contact.method == "nodes" else half_space
        )

    @property
    @abstractmethod
    def legs(self) -> tuple[int, ...]:
        """Number of increments of each leg of a cycle; 0 where it is automatic."""

    @abstractmethod
    def divided(self, legs: Sequence[int]) -> dict[str, Any]:
        """Return the case entries for these numbers of increments in the legs of a cycle."""

    @property
    def expected_legs(self) -> tuple[int, ...]:
        """Number of increments of each leg, with an estimate where it is automatic."""
        each = ceil(EXPECTED_INCREMENTS * sqrt(0.01 / self.wear.tolerance))
        return tuple(count or each for count in self.legs)

    @property
    def increments_outline(self) -> str:
        """Number of increments of a cycle, in words."""
        count = sum(self.expected_legs)
        if any(self.legs):
            return f"{count} increments"
        return (
            f"as many increments as depth needs for an error of {shares(self.wear.tolerance)}, "
            f"about {min(count, MOST_INCREMENTS)} and at most {MOST_INCREMENTS}"
        )

    @property
    def recoupling(self) -> Coupling:
        # Where nodes wear, the whole structure is solved in every step.
        return super().recoupling if self.contact.method == "nodes" else self.coupling
