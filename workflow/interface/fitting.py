"""Fits of parameters to measurements in Python."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from sa_solver.types import Array
from workflow.case.source import IN_PYTHON
from workflow.fit.fitting import Fitted
from workflow.fit.report import report, summary
from workflow.fit.running import run_fit, write_fit
from workflow.fit.schema import load_fit, parse_fit, text_of
from workflow.fit.section import section_of

AnyFit = str | os.PathLike[str] | Mapping[str, Any]
"""Fit: the path of its file, or its entries as nested dictionaries."""


def fit(
    asked: AnyFit, /, out: str | os.PathLike[str] | None = None, *, force: bool = False
) -> FitResult:
    r"""Fit parameters of a case to measurements.

    ``asked`` has the contents that ``fretscale new`` writes for ``fit_joint``, ``fit_loops``,
    ``fit_wear`` or ``fit_profiles``: it is the path of such a file, or a dictionary of its entries,
    in which relative file names start from the current folder. The section of a case, tables,
    summary and figure are written to the folder ``out``, if given; with ``force`` they replace
    those of an earlier fit. ``fit_profiles`` needs ``out`` for its runs.

    Returns the parameters with their bounds. Raises :class:`CaseError` and :class:`UserError` for a
    file, tables or data that allow no fit, and :class:`FretscaleError` where no start leads to a
    solution.

    Examples
    --------
    Worn volumes of four tests:

    >>> import fretscale, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = pathlib.Path(folder, "volumes.csv")
    ...     rows = ["energy [kJ], volume [mm^3]", "2, 3e-3", "4, 6.1e-3", "6, 9e-3", "8, 12e-3"]
    ...     _ = table.write_text("\n".join(rows))
    ...     found = fretscale.fit(
    ...         {
    ...             "title": "Four tests",
    ...             "fit": "wear_coefficient",
    ...             "measurements": [{"file": str(table)}],
    ...             "wear": {"law": "energy"},
    ...         }
    ...     )
    >>> alpha = found["wear.both.coefficient"]
    >>> print(f"{alpha.value:.0f} {alpha.unit}, {alpha.lower:.0f} to {alpha.upper:.0f}")
    1503 um^3/J, 1488 to 1519
    """
    given = (
        parse_fit(text_of(asked), IN_PYTHON)
        if isinstance(asked, Mapping)
        else load_fit(Path(asked))
    )
    fitted = run_fit(given, None if out is None else Path(out), force)
    if out is not None:
        write_fit(fitted, Path(out), force)
    return FitResult(fitted)


class FittedParameter(NamedTuple):
    """Free parameter in ``unit``: its ``value``, standard ``deviation`` and 95 % bounds.

    The bounds are ``lower`` and ``upper``. Numbers are None where the data do not determine the
    parameter; ``caveat`` then says why. ``shares`` are the contributions of each kind of data to
    the variance.

    Examples
    --------
    >>> import fretscale
    >>> rate = fretscale.FittedParameter("1/J", 3e-4, 1e-5, 2.8e-4, 3.2e-4, "", {"friction": 1.0})
    >>> rate.value
    0.0003
    """

    unit: str
    value: float | None
    deviation: float | None
    lower: float | None
    upper: float | None
    caveat: str
    shares: dict[str, float]


class FitResult:
    r"""Result of a fit; printed, it is the report of ``fretscale fit``.

    ``parameters`` has the parameters by their paths in a case, as has ``result["joint.friction"]``.
    ``correlation`` is their correlation matrix ``(p, p)``, ``section`` the YAML of a case, and
    ``plausibility_warnings`` are warnings about the fit. ``summary`` has all of this, as in
    ``summary.json``.

    Examples
    --------
    Stiffness that falls by a constant per joule, measured without error:

    >>> import fretscale, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = pathlib.Path(folder, "loops.csv")
    ...     rows = [f"{10 * k}, {20 - 0.1 * k}" for k in range(6)]
    ...     _ = table.write_text("\n".join(["energy [J], kt [N/um]", *rows]))
    ...     found = fretscale.fit(
    ...         {
    ...             "title": "Six loops",
    ...             "fit": "joint_evolution",
    ...             "measurements": [{"file": str(table)}],
    ...             "law": "bouc_wen",
    ...             "evolution": {"stiffness": {"kind": "linear"}},
    ...         }
    ...     )
    >>> {path: round(parameter.value, 9) for path, parameter in found.parameters.items()}
    {'joint.stiffness': 20.0, 'evolution.stiffness.slope': -0.0005}
    """

    def __init__(self, fitted: Fitted) -> None:
        self._fitted = fitted
        self.section = section_of(fitted)
        self.plausibility_warnings = tuple(map(str, fitted.plausibility_warnings))
        self.summary = summary(fitted, self.section)

    def __getitem__(self, path: str) -> FittedParameter:
        return self.parameters[path]

    def __str__(self) -> str:
        return "\n".join(report(self._fitted))

    @property
    def parameters(self) -> dict[str, FittedParameter]:
        """Free parameters by their paths."""
        return {path: _parameter(reported) for path, reported in self.summary["parameters"].items()}

    @property
    def correlation(self) -> Array:
        """Correlation of the parameters ``(p, p)`` in order; NaN where one is not determined."""
        return self._fitted.fit.correlation


def _parameter(reported: Mapping[str, Any]) -> FittedParameter:
    lower, upper = reported["bounds"] or (None, None)
    return FittedParameter(
        reported["unit"],
        reported["value"],
        reported["deviation"],
        lower,
        upper,
        reported["doubt"],
        dict(reported["shares"]),
    )
