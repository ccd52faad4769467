"""Bodies of a rig as matrices of another program, with joints at their points."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Discriminator, Tag, model_validator

from sa_solver.types import Array
from workflow.analyses.rig.bodies.matrix_files import MatrixFiles, Stamps
from workflow.analyses.rig.bodies.point_kinds import known, matching
from workflow.analyses.rig.bodies.unknowns_file import AXES
from workflow.analyses.rig.places import NEXT, Moved
from workflow.analyses.rig.structure import JointedBody
from workflow.case.fields import Quantity, Whole, shown
from workflow.case.files.input_files import InputFileError
from workflow.case.sections import Section, Title, disagreement, entry, together
from workflow.case.text.plain import counted, plain, shares
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.shell.memory import Memory, factor_bytes
from workflow.shell.run_time import factors

if TYPE_CHECKING:
    from fe_models.joints.reduction import ReducedModel
    from fe_models.matrices import ExternalMatrices

# SMALL: most unknowns with which `check` builds the model itself. MODERATE: most unknowns whose
# full matrices give frequencies within seconds. MANY: number from which keeping all is doubtful.
SMALL, MODERATE, MANY = 600, 20_000, 2000
# Dense matrices held at once; sets of shapes over all unknowns; seconds of all work on 1000
# unknowns that are all kept.
DENSE_MATRICES, SHAPES, ALL_KEPT = 12, 3, 5.0
# Softening of massless motions (a share) from which a warning is given.
SOFT = 0.03
# Number of frequencies above rigid motions, and of held unknowns, that are reported.
MOST_REPORTED = 6
# Bounds of a plausible structure with joints: its lowest elastic frequency [Hz], its mass [t].
SLOWEST, FASTEST = 0.05, 1e6
LIGHTEST, HEAVIEST = 1e-9, 1e4


@contextmanager
def refusing(body: MatrixBody) -> Iterator[None]:
    """Report what is wrong with matrices at the entry of the case that they come from."""
    from fe_models.matrices import MatrixError

    try:
        yield
    except MatrixError as error:
        own = error.part in ("retained", "modes")
        key = error.part if own else f"matrices.{body.matrices.key_of(error.part)}"
        raise disagreement(str(error), key) from error
    except InputFileError as error:
        raise disagreement(str(error), "matrices") from error


class LoadCase(Section):
    """A load of the matrices: forces wherever its column has non-zero values."""

    known_by: ClassVar[frozenset[str]] = frozenset({"load"})

    load: Annotated[int, Whole(1, 10_000)] = entry(
        "column of the loads, whose forces are multiplied by the force of the excitation", 1
    )


def _way(value: object) -> str:
    """Return how a force is given: by a load, or else by points."""
    by_load = isinstance(value, LoadCase) or (isinstance(value, dict) and "load" in value)
    return "(load)" if by_load else "(points)"


Driven = Annotated[
    Annotated[Moved, Tag("(points)")] | Annotated[LoadCase, Tag("(load)")], Discriminator(_way)
]


class Matrices(Section):
    """Matrices of a structure."""

    kind: Literal["matrices"] = entry("stiffness and mass of another program", "matrices")
    matrices: MatrixFiles = entry("files and units of the matrices")
    retained: tuple[Title, ...] = entry(
        "points, or kinds of them, onto which large matrices are first reduced (Craig-Bampton); "
        "without them all are kept",
        ["pad", "tip"],
        default=(),
    )
    modes: Annotated[int, Whole(0, 1000)] | None = entry(
        "number of modes kept with the retained points, the lowest ones with these points held",
        20,
        default=None,
    )
    massless: Annotated[float, Quantity("Hz", above=0.0, at_most=1e9)] | None = entry(
        "natural frequency that is given to motions without mass, far above those of interest: "
        "at a frequency f they are (f / massless)² too soft, and damped as modes are; without it "
        "points without mass follow the others, and no other motion may lack mass [Hz]",
        "200 kHz",
        default=None,
    )


class MatrixBody(JointedBody, Matrices):
    """Matrices of another program, with joints, masses and springs at their points."""

    in_schema: ClassVar[Mapping[str, Any]] = together("retained", "modes")

    driven: Driven | None = entry(  # type: ignore[assignment]
        "points that share the force of the excitation evenly, or a load; none where the "
        "excitation of a steady vibration names its own",
        default=None,
    )

    @model_validator(mode="after")
    def _modes_of_retained(self) -> MatrixBody:
        if self.retained and self.modes is None:
            raise disagreement("missing; allowed: with retained, 0 or more", "modes", "retained")
        if self.modes is not None and not self.retained:
            raise disagreement(
                f"{self.modes}: given without retained; allowed: with points to keep", "modes"
            )
        return self

    @model_validator(mode="after")
    def _is_a_structure(self) -> MatrixBody:
        """Read the files together with the case, and build the model if there are few unknowns."""
        with refusing(self):
            matrices = self.matrices.read()
        self._check_points()
        count = matrices.loads.shape[1]
        if isinstance(self.driven, LoadCase) and self.driven.load > count:
            none = "points, as no loads have a usual name"
            for name in matrices.offered.get("loads", ()):
                none += f", or matrices.loads: {name}"
            allowed = f"1 to {count}" if count else none
            raise disagreement(f"{self.driven.load}: no such load; allowed: {allowed}", "driven")
        if self.small:
            with refusing(self):
                self.reduced()
        return self

    @property
    def small(self) -> bool:
        """True if the model is quick to build."""
        return len(self.matrices.read().unknowns) <= SMALL

    def _check_points(self) -> None:
        """Refuse points that do not exist."""
        wanted = {f"retained.{k}": point for k, point in enumerate(self.retained)}
        sections = {
            f"{name}.{k}": part
            for name in ("joints", "masses", "springs")
            for k, part in enumerate(getattr(self, name))
        }
        for key, part in (sections | {"driven": self.driven, "seen": self.seen}).items():
            for end in ("points", "against"):
                point = getattr(part, end, None)
                if point is not None:
                    # Whether there is a next sector is checked where joints are built.
                    wanted[f"{key}.{end}"] = point.removeprefix(NEXT)
        for key, point in wanted.items():
            there = self.points if key.startswith("retained.") else self.places
            if not matching(there, point):
                held = ", because it is not retained" if matching(self.points, point) else ""
                raise disagreement(
                    f"{shown(point)}: no such point{held}; allowed: {known(there)}", key
                )

    @property
    def points(self) -> list[str]:
        """All points of the matrices, without modes."""
        unknowns = self.matrices.read().unknowns
        return list(dict.fromkeys(u.point for u in unknowns if u.direction != "modal"))

    @property
    def kept(self) -> list[str]:
        """Points of the model: the retained ones, or all."""
        if not self.retained:
            return self.points
        return [p for wanted in self.retained for p in matching(self.points, wanted)]

    @property
    def places(self) -> list[str]:
        """Points of the model, and masses that are not part of the body."""
        return [*self.kept, *(mass.name for mass in self.further_masses)]

    @property
    def joint_count(self) -> int:
        """Number of joints."""
        return sum(
            len(matching(self.places, joint.points.removeprefix(NEXT))) for joint in self.joints
        )

    @property
    def laden(self) -> dict[str, float]:
        """Masses added to displacements, by name [t]."""
        laden: defaultdict[str, float] = defaultdict(float)
        for mass in self.masses:
            points = matching(self.kept, mass.points)
            for point in points:
                for axis in AXES:
                    laden[f"{point} {axis}"] += mass.mass / len(points)
        return laden

    def reduced(
        self, done: Callable[[], None] = lambda: None
    ) -> tuple[ReducedModel, tuple[str, ...]]:
        """Return the model, with names of unknowns without mass, or of its lightest motions.

        Without ``massless``, unknowns without mass follow the others statically and are removed
        from the model. With it, these motions are given mass and all unknowns stay; the names are
        those of the unknowns that move most in them.

        Raises ``MatrixError``.
        """
        from fe_models.matrices import (
            check_definite,
            on_all,
            on_retained,
            with_light_motions,
            without_massless,
        )

        matrices = self.matrices.read()
        if self.retained:
            model = on_retained(matrices, self.kept, self.modes or 0, done)
        else:
            model = on_all(matrices)
        if self.massless is not None:
            model, light = with_light_motions(model, self.massless)
        else:
            model, light = without_massless(model, tuple(self.laden))
        check_definite(model, self.laden)
        return model, light

    def memory(self) -> Memory:
        """Return the memory of the model: dense matrices, and factors to reduce large ones."""
        matrices = self.matrices.read()
        size, retained = len(matrices.unknowns), set(self.kept)
        if not self.retained:
            return Memory(DENSE_MATRICES * size**2, "give structure.retained and structure.modes")
        kept = sum(unknown.point in retained for unknown in matrices.unknowns)
        numbers = SHAPES * size * (kept + (self.modes or 0)) + DENSE_MATRICES * kept**2
        return Memory(numbers, "retain fewer points, or modes", factor_bytes(size // 3))

    def build_time(self) -> float:
        """Return the time to build the model [s]."""
        size = len(self.matrices.read().unknowns)
        if self.retained:
            return factors(size / 3.0)
        return float(ALL_KEPT * (size / 1000.0) ** 3)

    @property
    def text(self) -> str:
        files = dict.fromkeys(path.name for path, _ in self.matrices.sources.values())
        if self.matrices.file is not None:
            files = {Path(self.matrices.file).name: None} | files
        reduced = f", reduced to {len(self.kept)} points and {self.modes} modes"
        return f"matrices of {', '.join(files)}{reduced if self.retained else ''}, {self.added}"

    @property
    def driven_place(self) -> str:
        if isinstance(self.driven, LoadCase):
            return f"load {self.driven.load}"
        return super().driven_place

    def outline(self) -> list[tuple[str, str]]:
        matrices = self.matrices.read()
        taken = (f"{part} {name}".rstrip() for part, name in (matrices.taken or {}).items())
        left = f"; not used: {', '.join(matrices.unused)}" if matrices.unused else ""
        count = len(matrices.unknowns)
        unknowns = f"{count} of {counted(len(self.points), 'point')}: {known(self.points)}"
        modal = sum(u.direction == "modal" for u in matrices.unknowns)
        unknowns += f"; {modal} of modes" if modal else ""
        if matrices.held:
            unknowns += f"; held: {', '.join(u.name for u in matrices.held[:MOST_REPORTED])}"
            unknowns += (
                f", {len(matrices.held)} in total" if len(matrices.held) > MOST_REPORTED else ""
            )
        masses = matrices.moved_mass()
        mass = ", ".join(f"{plain(m, 't', 4)} along {axis}" for axis, m in masses.items())
        rows = [
            ("matrices", f"{', '.join(taken)}{left}"),
            ("unknowns", unknowns),
            ("mass", f"{mass}, moved along x, y or z as a whole"),
        ]
        if isinstance(self.driven, LoadCase):
            rows.append(("load", _resultant(matrices, self.driven.load)))
        return [*rows, *self._quick_frequencies()]

    def _quick_frequencies(self) -> list[tuple[str, str]]:
        """Return the lowest frequencies without joints and additions, if quick to find."""
        lowest = self.lowest_frequencies()
        if lowest is None or not len(lowest):
            return []
        values = ", ".join(f"{frequency:.5g}" for frequency in lowest)
        return [("modes", f"lowest without joints, masses and springs: {values} Hz")]

    def lowest_frequencies(self) -> Array | None:
        """Return the lowest natural frequencies of the matrices [Hz], None if this takes long."""
        if len(self.matrices.read().unknowns) > MODERATE:
            return None
        return _frequencies(self.matrices, self.matrices.stamps)

    def plausibility_warnings(self, highest: float) -> Iterator[Notice]:
        """Yield plausibility warnings about entries, for motions up to ``highest`` [Hz]."""
        if self.massless is not None and highest > SOFT * self.massless:
            yield Notice(
                WarningKind.MASSLESS_TOO_LOW,
                f"structure.massless: {plain(self.massless, 'Hz')} is too low: at "
                f"{plain(highest, 'Hz', 3)}, the highest frequency of the motion, what has no "
                f"mass is {shares((highest / self.massless) ** 2)} too soft",
            )
        matrices = self.matrices.read()
        count = len(matrices.unknowns)
        if count > MANY and not self.retained:
            yield Notice(
                WarningKind.NOT_REDUCED,
                f"structure.retained: none, so that all {count} unknowns are kept; usual for more "
                f"than {MANY}: some points, and modes",
            )
        if names := matrices.offered.get("damping"):
            yield Notice(
                WarningKind.DAMPING_NOT_TAKEN,
                f"structure.matrices.damping: no matrix with a usual name; {' and '.join(names)} "
                f"could be it: damping: {names[0]}",
            )
        for axis, mass in matrices.moved_mass().items():
            if mass and not LIGHTEST <= mass <= HEAVIEST:
                yield Notice(
                    WarningKind.UNUSUAL_MATRICES,
                    f"structure.matrices.units: the mass along {axis} is {plain(mass, 't', 3)}: "
                    "are they right?",
                )
                break
        lowest = self.lowest_frequencies()
        elastic = np.empty(0) if lowest is None else lowest[lowest > 0.0]
        if len(elastic) and not SLOWEST <= elastic[0] <= FASTEST:
            yield Notice(
                WarningKind.UNUSUAL_MATRICES,
                f"structure.matrices.units: the lowest frequency above 0 is {elastic[0]:.3g} Hz: "
                "are they right, including mass?",
            )


def _resultant(matrices: ExternalMatrices, number: int) -> str:
    """Return the sum of the forces of a load, per unit load."""
    column = matrices.loads[:, number - 1]
    sums = [
        f"{sum(f for f, u in zip(column, matrices.unknowns, strict=True) if u.direction == axis):g}"
        for axis in AXES
    ]
    return f"{number}, with total forces of {', '.join(sums)} along x, y, z for a force of 1"


@lru_cache(4)
def _frequencies(files: MatrixFiles, stamps: Stamps) -> Array:
    """Return the lowest natural frequencies [Hz], rigid motions as 0; empty if none are found."""
    from fe_models.matrices import MatrixError, lowest_frequencies
    from fe_models.solvers.linear_solver import SolverError

    try:
        return lowest_frequencies(files.read(), MOST_REPORTED)
    except (MatrixError, SolverError):  # masses that the case adds may still cure this
        return np.empty(0)
