"""Tightened bolts of a user's mesh, as sections of a case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import model_validator

from workflow.analyses.wear.case.sections import NonlinearitySection, PressingForce
from workflow.analyses.wear.structures.mesh.legs import Legs
from workflow.analyses.wear.structures.mesh.load import (
    KINDS,
    Coordinate,
    Direction,
    MeshLoad,
    Name,
)
from workflow.case.fields import Quantity
from workflow.case.sections import disagreement, entry

if TYPE_CHECKING:
    from fe_models.loads import pretension as fe

Shortening = Annotated[float, Quantity("mm", above=0.0, at_most=100.0)]


class BoltLoad(MeshLoad):
    """A bolt that is cut across its shank, shortened there, and then held at this length."""

    name: Name = entry("name of the bolt in all results", "bolt_1")
    body: Name = entry("body of the bolt, with its head and nut", "blade")
    through: tuple[Coordinate, Coordinate, Coordinate] = entry(
        "point of the shank at which it is cut, across the axis [mm]", [0.0, 0.0, "2 mm"]
    )
    axis: Direction = entry("direction of the bolt [1]", [0.0, 0.0, 1.0])

    @property
    def tension(self) -> float | None:
        """Tension to which the bolt is tightened [N]; None if its shortening is given."""
        return None

    @property
    def ties(self) -> bool:
        """True: the cut of a bolt is checked together with ties."""
        return True

    @property
    def places(self) -> Iterator[str]:
        yield f"of {self.body}"

    def described(self) -> fe.Pretension:
        """Return the bolt as the structure takes it: shortened by 1 mm if its force is given."""
        from fe_models.loads.pretension import Pretension

        through, axis = np.array(self.through), np.array(self.axis)
        return Pretension(self.body, through, axis, getattr(self, "shortening", 1.0))


class PretensionLoad(BoltLoad):
    """A bolt that is tightened to a force in the first leg, and then held at its length."""

    kind: Literal["pretension"] = entry(KINDS, "pretension")
    force: PressingForce = entry(
        "tension at the end of the first leg, of the meshed part of the bolt; in two dimensions "
        "per length [N]",
        "10 kN",
    )

    @model_validator(mode="after")
    def _is_tightened_first(self) -> PretensionLoad:
        if self.path[0] != 1.0:
            raise disagreement(
                f"{self.path[0]:g} at the end of the first leg, in which the bolt is tightened; "
                "allowed: 1 first",
                "path",
            )
        return self

    @property
    def tension(self) -> float | None:
        return self.force


class ShorteningLoad(BoltLoad):
    """A bolt that is shortened by a given length, and then held at this length."""

    kind: Literal["shortening"] = entry(KINDS, "shortening")
    shortening: Shortening = entry("shortening of the shank [mm]", "20 um")


def check_bolts(loads: Sequence[MeshLoad], path: Legs, nonlinearity: NonlinearitySection) -> None:
    """Refuse bolts with equal names, bolts tightened in every cycle, and nonlinear structures."""
    bolts = {i: load for i, load in enumerate(loads) if isinstance(load, BoltLoad)}
    names = [bolt.name for bolt in bolts.values()]
    for index, bolt in bolts.items():
        if names.count(bolt.name) > 1:
            raise disagreement(
                f"two bolts called {bolt.name}; allowed: different names",
                f"structure.loads.{index}.name",
            )
        if bolt.tension is not None and path.cycle_from < 2:
            raise disagreement(
                "1: the bolts would be tightened in every cycle; allowed: 2 or more, after the "
                "leg that tightens them",
                "load_path.cycle_from",
                "load_path",
            )
    if bolts and nonlinearity.asked:
        raise disagreement(
            "bolts are tightened, which only linear structures can do; allowed: stiffness: "
            "linear without a check",
            "nonlinearity",
        )
