"""Tests of scripts that show a run, in ParaView itself where it is installed."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from tests.workflow.conftest import CONTENTS
from workflow.analyses.wear import ANALYSIS
from workflow.pictures.drawing import write_paraview

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (shutil.which("pvbatch") and shutil.which("Xvfb")),
        reason="needs ParaView's pvbatch, and Xvfb to draw without a screen",
    ),
]


@pytest.fixture
def screen() -> Iterator[str]:
    """Start a screen in memory, whose server takes a free number and reports it when ready.

    Without `-noreset` the server restarts when its last window closes, and refuses connections
    meanwhile: ParaView opens a test window before its own.
    """
    reported, tells = os.pipe()
    command = ["Xvfb", "-displayfd", str(tells), "-noreset", "-nolisten", "tcp"]
    with (
        os.fdopen(reported, encoding="ascii") as number,
        subprocess.Popen(command, pass_fds=[tells], stderr=subprocess.DEVNULL) as server,
    ):
        os.close(tells)
        yield f":{number.readline().strip()}"
        server.terminate()


@pytest.mark.parametrize("script", ["view", "view_mission"])
def test_paraview_draws_every_view(results: Path, tmp_path: Path, screen: str, script: str) -> None:
    """It works from another folder than that of the script, and after the run has been moved."""
    assert ANALYSIS.pictures is not None
    write_paraview(ANALYSIS.pictures, CONTENTS, results, tmp_path / "run" / "paraview")
    (tmp_path / "run").rename(tmp_path / "moved run")
    picture = tmp_path / f"{script}.png"
    done = subprocess.run(
        ["pvbatch", f"moved run/paraview/{script}.py", picture.name],
        cwd=tmp_path,
        env={**os.environ, "DISPLAY": screen},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert "ERR" not in done.stderr, done.stderr[-2000:]
    shown = imread(picture)[:, :, :3]
    # Something that has colours, and neither white nor the greys of texts, in every view: a large
    # one on the left and two on the right, or two side by side.
    colourful = np.ptp(shown, axis=2) > 0.15
    left, right = np.array_split(colourful, 2, axis=1)
    views = [left, *np.array_split(right, 2 if script == "view" else 1)]
    assert [view.mean() > 0.02 for view in views] == [True] * len(views)
