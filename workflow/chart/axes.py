"""Approximations that apply to a case, each with the settings that the case admits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from workflow.analyses.rig.approximations import OF_MOTION
from workflow.analyses.wear.approximations.approximation import Approximation, Rung
from workflow.analyses.wear.approximations.registry import APPROXIMATIONS
from workflow.case.sections import Case
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError, UserError
from workflow.kinds import load_case

AXES = (*APPROXIMATIONS, *OF_MOTION)
AS_WRITTEN = Rung("as written")


@dataclass(frozen=True)
class Setting:
    """Rung applied to its case; ``text`` is the case as YAML, which identifies equal settings."""

    rung: Rung
    case: Case
    text: str

    @classmethod
    def of(cls, case: Path, base: Sequence[str], rung: Rung = AS_WRITTEN) -> Setting:
        """Return the setting of a rung on a case file with overrides ``base``; raise CaseError."""
        changed = load_case(case, (*base, *rung.overrides))
        return cls(rung, changed, dump_case(changed))


def axes_of(
    case: Path, base: Sequence[str], names: Sequence[str]
) -> dict[Approximation, list[Setting]]:
    """Return the rungs of the axes called ``names``; without names, of all axes that apply.

    Raises :class:`UserError` for an axis that does not exist or does not apply.
    """
    baseline = Setting.of(case, base)

    def applying(axes: Sequence[Approximation]) -> dict[Approximation, list[Setting]]:
        """Return the axes with more than one rung."""
        ladders = {axis: _settings(axis, baseline, case, base) for axis in axes}
        return {axis: settings for axis, settings in ladders.items() if len(settings) > 1}

    wanted = applying([axis for axis in AXES if not names or axis.name in names])
    for name in names:
        if all(axis.name != name for axis in wanted):
            known = any(axis.name == name for axis in AXES)
            wrong = "does not apply to this case" if known else "no such axis"
            offered = ", ".join(axis.name for axis in applying(AXES))
            raise UserError(f"--axis {name}: {wrong}; allowed: {offered or 'none'}")
    if not wanted:
        raise UserError(f"{case}: a case of this kind has nothing to chart")
    return wanted


def _settings(
    axis: Approximation, baseline: Setting, case: Path, base: Sequence[str]
) -> list[Setting]:
    """Return the rungs of the axis that the case admits, with its own settings, each once."""
    settings: dict[str, Setting] = {}
    for rung in axis.rungs(baseline.case):
        try:
            setting = Setting.of(case, base, rung)
        except CaseError:
            continue
        settings.setdefault(setting.text, setting)
    if settings and baseline.text not in settings:
        return [baseline, *settings.values()]
    return list(settings.values())
