"""Tests of bodies of a mesh file, one of which overhangs the other's end."""

from pathlib import Path

import numpy as np
import pytest

from tests.workflow.wear.mesh.plane_blocks import RADIUS, Blocks, solved

# Of the base, within an element of the foot, and of that [mm].
END, FOOT, LOAD = 0.9, (-2.0, 2.0), 100.0


def test_nothing_is_carried_where_one_body_is_not(tmp_path: Path) -> None:
    blocks = Blocks((-6.0, END), 4.0, FOOT, 1.0, FOOT, line_contact=64)
    history, stage, first = solved(blocks.press(tmp_path, 0.4, LOAD))
    origin, pitch = history.interface.frame.origin[0], stage.grid.pitch[0]
    local = stage.grid.x[:, 0]
    x = local + origin
    # The last element of the foot that touches reaches beyond the base.
    assert history.interface.coordinates[:, 0].max() + origin > END + pitch
    gap, both = stage.settings.gap[:, 0], (x < END) & (x > FOOT[0])
    np.testing.assert_allclose(gap[both], 0.5 * local[both] ** 2 / RADIUS, atol=1e-12)
    pressure = stage.contact.unworn_tractions(history, first).pressure[0, :, 0]
    assert not pressure[~both].any()
    assert pressure[both].sum() * pitch == pytest.approx(LOAD, rel=1e-6)
