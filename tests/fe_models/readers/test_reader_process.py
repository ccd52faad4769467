"""Damaged files crash at most the process that reads them, and give one line of error."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fe_models.geometry.imported import read_bodies
from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.reader_process import read_in_subprocess

posix_only = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
PATIENCE = 120.0


@pytest.fixture(scope="module")
def boxes(tmp_path_factory):
    path = tmp_path_factory.mktemp("cad") / "boxes.step"
    with gmsh_model("cad") as gmsh:
        gmsh.model.occ.addBox(0.0, 0.0, 0.0, 2.0, 1.0, 1.0)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    return path


def test_what_is_read_apart_is_what_is_read_here(boxes, reads_here, monkeypatch):
    here = read_bodies(boxes, 1.0)
    monkeypatch.undo()
    apart = read_bodies(boxes, 1.0)
    assert (apart.bodies["solid_1"].points == here.bodies["solid_1"].points).all()
    assert (apart.bodies["solid_1"].mesh.t == here.bodies["solid_1"].mesh.t).all()


def test_a_damaged_solid_is_one_line(boxes, tmp_path):
    """Check a file with an invalid entity, which crashes OpenCASCADE."""
    damaged = tmp_path / "damaged.step"
    damaged.write_text(boxes.read_text().replace("FACE_BOUND", "FACE_BO ND", 1))
    with pytest.raises(MeshError) as reported:
        read_bodies(damaged, 1.0)
    assert str(reported.value).startswith(f"{damaged}: gmsh ")
    assert "\n" not in str(reported.value)


@posix_only
@pytest.mark.parametrize(
    ("ending", "number"), [(signal.raise_signal, 11), (signal.raise_signal, 9), (os._exit, 3)]
)
def test_the_end_of_a_reading_process_is_an_error(ending, number):
    with pytest.raises(MeshError, match=f"^{number}: "):
        read_in_subprocess(ending, number)


@posix_only
@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
def test_the_process_ends_with_whoever_reads():
    """Check that the reading process ends with its parent, however that ends."""
    reading = (
        "from fe_models.readers.reader_process import read_in_subprocess as r; r(time.sleep, 99)"
    )
    with subprocess.Popen([sys.executable, "-c", f"import time; {reading}"]) as process:
        below = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        end = time.monotonic() + PATIENCE
        while not (children := below.read_text().split()) and time.monotonic() < end:
            time.sleep(0.01)
        (child,) = children
        process.kill()
    # A process that nobody has waited for yet is a zombie.
    state = Path(f"/proc/{child}/stat")
    while time.monotonic() < end and state.exists() and ") Z " not in state.read_text():
        time.sleep(0.01)
    assert not state.exists() or ") Z " in state.read_text()
