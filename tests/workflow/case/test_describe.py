"""Tests of ``fretscale describe``: the picture of an assembly and its file for ParaView."""

import numpy as np
import pytest
import pyvista as pv

from fe_models.geometry.imported import patch, read_bodies
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import edit
from tests.workflow.output.figure_checks import problems
from workflow.commands.assembly import shown_bodies
from workflow.commands.assembly_figure import figure

pytestmark = pytest.mark.usefixtures("reads_here")


@pytest.fixture
def file(blocks):
    """Return two blocks with a node at a corner, and the nodes of a face."""
    path = blocks.with_name("blocks.inp")
    sets = "*Nset, nset=tip\n27\n*Nset, nset=nodes_high, generate\n19, 27, 1\n"
    edit(path, "*End Part\n*Assembly", f"{sets}*End Part\n*Assembly")
    return path


def test_assembly_is_drawn_and_written(file, tmp_path):
    out = tmp_path / "drawn"
    ending = invoke("describe", file, "--out", out)
    assert ending.exit_code == 0, ending.stderr
    assert "node set nodes_high: 9 nodes, a face of triangles" in ending.output
    assert ending.output.splitlines()[-2:] == [str(out / f"assembly.{s}") for s in ("png", "vtu")]
    assert (out / "assembly.png").stat().st_size > 10_000
    again = invoke("describe", file, "--out", out)
    assert again.exit_code == 2
    assert "--force" in again.stderr
    assert invoke("describe", file, "--out", out, "--force").exit_code == 0


def test_groups_are_in_the_file_for_paraview(file, tmp_path):
    """It has the surfaces of bodies and boundaries, each facet once, and the node numbers."""
    assert invoke("describe", file, "--out", tmp_path / "drawn").exit_code == 0
    grid = pv.read(tmp_path / "drawn" / "assembly.vtu")
    imported = read_bodies(file)
    sizes = grid.compute_cell_sizes(length=False)
    for number, (name, size) in enumerate({"Base-1": 24.0, "Foot-1": 6.0}.items(), start=1):
        mine = grid.cell_data[f"body {number} {name}"] == 1
        np.testing.assert_array_equal(mine, grid.cell_data["body"] == number)
        assert sizes.cell_data["Area"][mine].sum() == pytest.approx(size, rel=1e-5)
        body = imported.bodies[name]
        for boundary in body.mesh.boundaries:
            facets = grid.extract_cells(grid.cell_data[f"boundary {boundary}"] == 1)
            expected = patch(body, boundary)
            area = facets.compute_cell_sizes(length=False, volume=False).cell_data["Area"].sum()
            assert area == pytest.approx(expected.area, rel=1e-5)
            centres = facets.cell_centers().points.mean(axis=0)
            np.testing.assert_allclose(centres, expected.centroid, atol=1e-6)
    tip = grid.point_data["node set tip"] == 1
    np.testing.assert_allclose(grid.points[tip], [[1.5, 1.5, 3.0]])
    assert grid.point_data["node"][tip].tolist() == [27]
    assert np.all(
        grid.cell_data["boundary nodes_high"] == grid.cell_data["boundary foot_high"]
    ) or (np.sum(grid.cell_data["boundary nodes_high"]) == 8)


def test_picture_has_all_bodies_and_each_alone(file):
    drawn = figure(shown_bodies(read_bodies(file)), "blocks.inp")
    drawn.canvas.draw()
    assert problems(drawn) == []
    assert len(drawn.subfigs) == 3
