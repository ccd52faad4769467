"""Progress, log, terminal, figures and report may each fail without ending the run."""

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.workflow.command_line import invoke, runs_here
from workflow.runs import run as running
from workflow.shell.forecast import Forecast
from workflow.shell.terminal import reporter
from workflow.shell.terminal.reporter import Reporter

CASE = """
title: A mass on a spring that hardens
analysis: vibration
structure: {kind: rig, masses: [1 kg], springs: [1000 N/mm], damping_ratio: 0.02}
joint: {law: polynomial_spring, stiffness: 0 N/mm, cubic: 1e6 N/mm^3}
forces: [0.5 N]
frequencies: [150 Hz, 170 Hz]
resolution: {harmonics: 1, samples: 32}
stability: none
output: {figures: [svg], paraview: false}
"""


def fails(*arguments: object, **settings: object) -> Any:
    """Raise an unexpected error."""
    raise TypeError("made up to fail")


class FullLog:
    """Log on a disk without room."""

    def write(self, text: str) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def close(self) -> None:
        self.write("")


def log_fails(patch: pytest.MonkeyPatch) -> None:
    made = Reporter.__init__

    def make(self: Any, *arguments: Any, **settings: Any) -> None:
        made(self, *arguments, **settings)
        self._log.close()
        self._log = FullLog()

    patch.setattr(Reporter, "__init__", make)


def prints_fail(patch: pytest.MonkeyPatch) -> None:
    class Gone:
        width, is_terminal, is_dumb_terminal = 80, False, False
        print = staticmethod(fails)

    patch.setattr(reporter, "console", Gone)


FAILURES: dict[str, tuple[str, Callable[[pytest.MonkeyPatch], Any]]] = {
    "forecast": ("progress:", lambda patch: patch.setattr(Forecast, "reach", fails)),
    "log": ("run.log:", log_fails),
    "terminal": ("terminal:", prints_fail),
    "figures": ("figures:", lambda patch: patch.setattr(running, "write_pictures", fails)),
    "report": ("report.html:", lambda patch: patch.setattr(running, "write_page", fails)),
}


def run(folder: Path) -> dict[str, Any]:
    """Return the summary of a run of the case."""
    path = folder / "case.yaml"
    path.write_text(CASE, encoding="utf-8")
    with runs_here():
        result = invoke("run", path, "--out", folder / "out")
    assert result.exit_code == 0, result.output
    summary: dict[str, Any] = json.loads((folder / "out" / "summary.json").read_text())
    return summary


def curve(folder: Path) -> Any:
    with h5py.File(folder / "out" / "results.h5") as file:
        return file["responses/00000/amplitude"][()]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("whole")
    return folder, run(folder)


@pytest.mark.parametrize("what", FAILURES)
def test_what_only_shows_a_run_fails_and_the_run_does_not(what, whole, tmp_path, monkeypatch):
    """Results equal those of a run without failures, and one warning names what is missing."""
    folder, summary = whole
    printed, fail = FAILURES[what]
    fail(monkeypatch)
    failed = run(tmp_path)
    np.testing.assert_array_equal(curve(tmp_path), curve(folder))
    assert failed["responses"] == summary["responses"]
    (warning,) = set(failed["warnings"]) - set(summary["warnings"])
    assert warning.startswith(printed)
    assert "the results are complete" in warning
    page = tmp_path / "out" / "report.html"
    assert page.exists() == (what != "report")


@pytest.mark.parametrize(("share", "done"), [(-0.5, 0.0), (np.nan, 0.0), (1.5, 1.0)])
def test_a_share_that_cannot_be_leaves_a_forecast_that_can(share: float, done: float) -> None:
    now = [0.0]
    forecast = Forecast(lambda: now[0])
    for at in (0.2, share):
        now[0] += 10.0
        forecast.reach(at)
    assert forecast.share == done
    assert forecast.left is None or forecast.left >= 0.0
