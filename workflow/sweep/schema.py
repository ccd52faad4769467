"""Schema of the file of a sweep: the case, the varied entries, and how they are combined."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, create_model, model_validator

from workflow.case import units
from workflow.case.fields import AnyValue, Entry, File, Whole, is_finite, shown
from workflow.case.loading import check_command, validated
from workflow.case.sections import Section, Title, disagreement, entry, one_of
from workflow.case.source import Source, read_text
from workflow.case.text.writing import scalar
from workflow.errors import CaseError, UserError
from workflow.sweep.fitted import FittedSample, read_fit

# Largest number of runs: more are a mistake, as each takes seconds at least.
MOST_RUNS = 10_000
# Designs for entries that are known with their uncertainty.
DRAWN = "sample", "linear"
# Digits of values computed from a range or a distribution: the table shows exactly what was run.
SIGNIFICANT = 6


@dataclass(frozen=True)
class WrittenNumber:
    """Number and the unit it was written with, "" for none."""

    number: float
    unit: str = ""

    @property
    def written(self) -> int | float | str:
        """Value as it is written in a case."""
        if self.unit:
            return f"{self.number:.{SIGNIFICANT}g} {self.unit}"
        return int(self.number) if self.number.is_integer() else self.number

    def over(self, unit: str) -> float:
        """Return the number as a multiple of ``unit``; "" is the base unit, as in a case."""
        if unit == self.unit:
            return self.number
        sizes = [units.to_base(f"1 {name}", None) if name else 1.0 for name in (self.unit, unit)]
        return self.number * sizes[0] / sizes[1]

    def with_number(self, number: float) -> WrittenNumber:
        """Return another number with the same unit, rounded."""
        return WrittenNumber(float(f"{number:.{SIGNIFICANT}g}"), self.unit)


def amount_of(value: object) -> WrittenNumber | None:
    """Return a value of an entry as a number with its unit; None if it is not a number."""
    if isinstance(value, str):
        try:
            number, unit = units.split(value)
            units.to_base(value, None)
        except (units.UnitError, ArithmeticError):
            return None
        return WrittenNumber(float(number), unit)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return WrittenNumber(float(value)) if is_finite(value) else None


@dataclass(frozen=True)
class SweptNumber(Entry):
    """Number with or without a unit; the case checks whether the unit is suitable."""

    positive: bool = False

    @property
    def allowed(self) -> str:
        return f"a {'positive ' if self.positive else ''}number, with a unit where the case has one"

    def parse(self, value: object) -> WrittenNumber:
        amount = value if isinstance(value, WrittenNumber) else amount_of(value)
        if amount is None:
            raise self.refusal(value, "not a number with a known unit")
        if self.positive and amount.number <= 0.0:
            raise self.refusal(value, "out of range")
        return amount

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [{"type": "number"}, {"type": "string"}]}


AnyAmount = Annotated[WrittenNumber, SweptNumber()]
PositiveAmount = Annotated[WrittenNumber, SweptNumber(positive=True)]
Scale = Literal["linear", "log"]


class _Between(Section):
    """Base of a range between two ends, set by name since ``from`` is a Python keyword."""

    @property
    def ends(self) -> tuple[WrittenNumber, WrittenNumber]:
        """First and last value, in the same unit."""
        return getattr(self, "from"), getattr(self, "to")  # noqa: B009

    @model_validator(mode="after")
    def _one_unit(self) -> _Between:
        _require_one_unit(self, "from", "to")
        return self


class _Range(_Between):
    """Evenly spaced values."""

    count: Annotated[int, Whole(2, MOST_RUNS)] | None = entry(
        "number of values, both ends included; not for design: sample", 5, default=None
    )
    scale: Scale = entry("linear, or log for equal ratios", "linear", default="linear")

    @model_validator(mode="after")
    def _positive_on_a_log_scale(self) -> _Range:
        first, last = self.ends
        if self.scale == "log" and not (first.number > 0.0 and last.number > 0.0):
            raise disagreement(
                "log between ends that are not both positive; allowed: linear, or positive ends",
                "scale",
            )
        return self


class _Uniform(_Between):
    """Uniform distribution between two ends."""

    kind: Literal["uniform"] = entry("kind of the distribution", "uniform")


_FIRST = {"from": (AnyAmount, entry("first value", "20 mm"))}
_LAST = {"to": (AnyAmount, entry("last value", "40 mm"))}
Range = create_model("Range", __base__=_Range, **_FIRST, **_LAST)  # type: ignore[call-overload]
Uniform = create_model("Uniform", __base__=_Uniform, **_FIRST, **_LAST)  # type: ignore[call-overload]


class Normal(Section):
    """Normal distribution; its tails are unbounded, so that a case may refuse extreme values."""

    kind: Literal["normal"] = entry("kind of the distribution", "normal")
    mean: AnyAmount = entry("mean of the values", "30 mm")
    deviation: PositiveAmount = entry("standard deviation of the values", "1 mm")

    @model_validator(mode="after")
    def _one_unit(self) -> Normal:
        _require_one_unit(self, "mean", "deviation")
        return self


class LogNormal(Section):
    """Lognormal distribution: 68 % of the values are within ``factor`` of the median."""

    kind: Literal["lognormal"] = entry("kind of the distribution", "lognormal")
    median: PositiveAmount = entry("median: half of the values are below it", "1e4 um^3/J")
    factor: Annotated[float, Field(gt=1.0)] = entry(
        "geometric standard deviation, exp of that of the logarithms [1]", 1.3
    )


def _require_one_unit(section: Section, first_key: str, second_key: str) -> None:
    first, second = getattr(section, first_key), getattr(section, second_key)
    if first.unit != second.unit:
        raise disagreement(
            f"{shown(second.written)} and {shown(first.written)}; allowed: the same unit",
            second_key,
        )


Distribution = Annotated[Uniform | Normal | LogNormal, Field(discriminator="kind")]


class Variation(Section):
    """Values that one entry of the case is given: exactly one of values, range and distribution."""

    in_schema: ClassVar[Mapping[str, Any]] = one_of("values", "range", "distribution")

    values: tuple[AnyValue, ...] | None = entry(
        "list of them", [0.3, 0.4], default=None, min_length=1
    )
    range: Range | None = entry("evenly spaced values", default=None)
    distribution: Distribution | None = entry("for design: sample", default=None)

    @model_validator(mode="after")
    def _one_of_them(self) -> Variation:
        keys = "values", "range", "distribution"
        chosen = [key for key in keys if getattr(self, key) is not None]
        if len(chosen) != 1:
            wrong = " and ".join(chosen) or "nothing"
            raise disagreement(f"{wrong} given; allowed: exactly one of {', '.join(keys)}")
        texts = [scalar(value) for value in self.values or ()]
        twice = [text for text in texts if texts.count(text) > 1]
        if twice:
            raise disagreement(f"{twice[0]}: given twice; allowed: once", "values")
        return self


class SweepFile(Section):
    """Runs of one case, each with other values."""

    title: Title | None = entry("one line; the case's by default", "Spread of wear", default=None)
    case: Annotated[str, File((".yaml", ".yml"))] = entry(
        "file, path from the folder of this one", "dovetail_2d.yaml"
    )
    set: dict[str, AnyValue] = entry("entries changed in every run", default={})
    vary: Section = entry("values of each entry, by its dotted path in the case", default=Section())
    fit: Annotated[str, File((".json",))] | None = entry(
        "summary.json of a fit, whose parameters vary too, with its bounds; for design: sample "
        "or linear",
        "wear/summary.json",
        default=None,
    )
    design: Literal["grid", "zip", "sample", "linear"] = entry(
        "grid: every value with every other; zip: first with first, second with second; sample: "
        "a Latin hypercube; linear: bands to first order, of a fit or normal distributions",
        "grid",
        default="grid",
    )
    samples: Annotated[int, Whole(1, MOST_RUNS)] | None = entry(
        "number of runs, for design: sample", 50, default=None
    )
    seed: Annotated[int, Whole(0, 2**31)] = entry("seed of the sample", 0, default=0)

    def variations(self) -> dict[str, Variation]:
        """Return the variation of each entry, by its path."""
        return {name: getattr(self.vary, name) for name in type(self.vary).model_fields}


class AnySweepFile(SweepFile):
    """Sweep file with any varied entries, for editors."""

    vary: dict[str, Variation] = entry(  # type: ignore[assignment]
        "values of each entry, by its dotted path in the case", default={}
    )


@dataclass(frozen=True)
class Sweep:
    """File of a sweep as read, with the places of its entries and the fit that it names."""

    name: str
    file: SweepFile
    source: Source
    fitted: FittedSample | None = None

    def place(self, path: str) -> str:
        """Return file and line, and the entry that varies or is set."""
        if self.fitted is not None and path in self.fitted.entries:
            return f"{self.source.where(('fit',))[1]}: fit: {path}"
        section = "set" if path in self.file.set else "vary"
        return f"{self.source.where((section, path))[1]}: {section}.{path}"


def load_sweep(path: Path) -> Sweep:
    """Read the file of a sweep; raise CaseError with a line ``file:line: key: ...`` per error."""
    source = Source(str(path), read_text(path))
    check_command(source, "sweep")
    file = validated(source, _kind_of(source))
    sweep = Sweep(str(path), file, source, _fitted(source, file))
    if wrong := list(_disagreements(sweep)):
        raise CaseError("\n".join(wrong))
    return sweep


def _fitted(source: Source, file: SweepFile) -> FittedSample | None:
    if file.fit is None:
        return None
    try:
        return read_fit(Path(file.fit))
    except UserError as error:
        raise CaseError(f"{source.where(('fit',))[1]}: fit: {error}") from None


def _kind_of(source: Source) -> type[SweepFile]:
    """Return a model of the file whose section ``vary`` has the entries of this file."""
    entries = source.at(("vary",))
    names = list(entries) if isinstance(entries, dict) else []
    fields: Any = {name: (Variation, entry("values, range or distribution")) for name in names}
    vary: Any = create_model("Vary", __base__=Section, **fields)
    field = SweepFile.model_fields["vary"]
    return create_model("SweepFile", __base__=SweepFile, vary=(vary, field))


def _disagreements(sweep: Sweep) -> Iterator[str]:
    """Yield lines about entries that contradict each other."""
    file, varied = sweep.file, sweep.file.variations()
    place = sweep.source.where
    yield from _without_variation(sweep)
    yield from _conflicts_with_fit(sweep)
    for name in varied.keys() & file.set.keys():
        yield f"{place(('set', name))[1]}: set.{name}: varies as well; allowed: one of them"
    if (file.design == "sample") != (file.samples is not None):
        by_default = "" if "design" in file.model_fields_set else ", which it is unless said"
        needed = f"not for design: {file.design}{by_default}"
        if file.samples is None:
            needed = "missing, the number of runs such as 50"
        yield f"{place(('samples',))[1]}: samples: {needed}; allowed: with design: sample"
    for name, variation in varied.items():
        if file.design == "linear":
            yield from _not_normal(sweep, name, variation)
        elif file.design != "sample":
            yield from _without_sample(sweep, name, variation)


def _without_variation(sweep: Sweep) -> Iterator[str]:
    file, where = sweep.file, f"{sweep.source.where(('vary',))[1]}: vary"
    if file.variations() or file.fit is not None:
        return
    if "vary" in file.model_fields_set:
        yield f"{where}: nothing; allowed: such as friction.coefficient"
    else:
        yield f"{where}: missing; allowed: what each entry is given, or fit"


def _conflicts_with_fit(sweep: Sweep) -> Iterator[str]:
    """Yield lines about entries that contradict the fit."""
    if sweep.fitted is None:
        return
    file, varied, place = sweep.file, sweep.file.variations(), sweep.source.where
    for name in sweep.fitted.entries:
        if name in varied or name in file.set:
            where = place(("vary" if name in varied else "set", name))[1]
            yield f"{where}: {name}: given by the fit, too; allowed: one of them"
    if file.design not in DRAWN:
        allowed = " or ".join(DRAWN)
        yield f"{place(('fit',))[1]}: fit: in design: {file.design}; allowed: design: {allowed}"


def _not_normal(sweep: Sweep, name: str, variation: Variation) -> Iterator[str]:
    """Yield a line if a band to first order is impossible for a variation."""
    if not isinstance(variation.distribution, Normal | LogNormal):
        yield (
            f"{sweep.place(name)}: in design: linear; allowed: a distribution of kind normal or "
            "lognormal"
        )


def _without_sample(sweep: Sweep, name: str, variation: Variation) -> Iterator[str]:
    """Yield lines about what a variation lacks where values are combined, not drawn."""
    where = f"{sweep.place(name)}"
    if variation.distribution is not None:
        yield f"{where}: a distribution in design: {sweep.file.design}; allowed: design: sample"
    elif variation.range is not None and variation.range.count is None:
        yield f"{where}.range.count: missing; allowed: number of values, such as 5"
