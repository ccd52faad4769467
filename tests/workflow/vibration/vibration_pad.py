"""Vibration case on a small pad, run in seconds: a block on 5 x 5 friction contacts.

The block is pressed on a crowned pad, so that its corners are open, and rocks when it is driven
above the pad: nodes stick, slip and lift off. It replaces the two specimens of a rig.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result

from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.rig import modal_damping
from sa_solver.types import Array
from tests.workflow.conftest import invoke
from workflow.analyses.vibration import model as vibration_model
from workflow.kinds import template
from workflow.models.rig.rig_model import RigModel

SIDE, ROWS = 10.0, 5  # of the pad [mm]
HEIGHT = 1.5  # of the drive over the pad [mm]
CROWN = 5e3  # radius of the pad [mm]
MASS, INERTIA = 1.2e-3, 0.04  # t, t mm²
SPRING, ROCKING_SPRING = 1000.0, 3e5  # N/mm, N mm/rad
LOAD = 60.0
CASE = """\
title: Block on a pad
analysis: vibration
structure:
  kind: friction_rig
  specimens: block.yaml
  masses: [1 kg, 1 kg]
  springs: [1 N/um, 1 N/um]
  damping_ratio: 0.05
joint:
  law: friction_contact
  normal_load: 60 N
  friction: 0.5
  stiffness: 45 N/um
  normal_stiffness: 58.5 N/um
forces: [2 N, 25 N]
frequencies: [60 Hz, 900 Hz]
resolution: {harmonics: [1, 3], samples: 32}
continuation: {longest_step: 0.6}
loops: {frequency: 100 Hz, harmonics: [[1], [1, 3, 5]]}
backbone: true
"""


def places() -> Array:
    """Return the positions of the nodes of the pad ``(j, 2)``."""
    line = np.linspace(-0.5 * SIDE, 0.5 * SIDE, ROWS)
    x, y = np.meshgrid(line, line, indexing="ij")
    return np.stack([x.ravel(), y.ravel()], axis=1)


def block() -> RigModel:
    """Return the block: x, y, z (up), rotation about y; driven along x and a little along y."""
    x, y = places().T
    mass = np.diag([MASS, MASS, MASS, INERTIA])
    stiffness = np.diag([SPRING, SPRING, 0.0, ROCKING_SPRING])
    rows = np.zeros((len(x), 3, 4))
    rows[:, 0, 0], rows[:, 0, 3] = 1.0, -HEIGHT
    rows[:, 1, 1] = 1.0
    rows[:, 2, 2], rows[:, 2, 3] = -1.0, x
    # Bouncing has no spring of its own, and so no damping of a mode.
    damping = modal_damping(mass, stiffness, 0.05) + np.diag([0.0, 0.0, 0.5, 2.0])
    names = ("x", "y", "z", "ry")
    return RigModel(
        DynamicModel(mass, damping, stiffness, rows.reshape(-1, 4), names),
        driven=np.array([1.0, 0.3, 0.0, 0.0]),
        seen=np.eye(4)[[1, 0]],
        labels=("block y", "block x"),
        directions=3,
        in_a_row=False,
        pressing=np.array([0.0, 0.0, -1.0, 0.0]),
        stretch=np.eye(4)[0],
        places=places(),
        gap=(x**2 + y**2) / (2.0 * CROWN),
        area=np.full(len(x), SIDE**2 / ROWS**2),
    )


def run_block(folder: Path, *overrides: str, rig: RigModel | None = None) -> Result:
    """Run the case into ``folder/out``, with the block in place of the specimens."""
    path = folder / "case.yaml"
    path.write_text(CASE, encoding="utf-8")
    (folder / "block.yaml").write_text(template("specimens"), encoding="utf-8")
    settings = [part for override in overrides for part in ("--set", override)]

    def stands_in(*_: Any) -> RigModel:
        return rig or block()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vibration_model, "rig_model", stands_in)
        return invoke("run", path, "--out", folder / "out", "--force", *settings)
