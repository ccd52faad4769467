"""Cached compiled functions that depend on functions in other files."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from wear.joints import compiled
from wear.joints.jenkins import advance_jenkins

SLOPE = """
from kernels.compiled import compiled

@compiled()
def slope():
    return {value}
"""
DOUBLED = """
from kernels.compiled import compiled
from kernels.slope import slope

@compiled(nogil=True)
def doubled():
    return 2.0 * slope()
"""
IN_TURN = """
from kernels.compiled import call_in_turn
from kernels.doubled import doubled

call_in_turn(doubled)
print(sum(doubled.stats.cache_misses.values()))
"""
# Without a cache folder that is set from outside.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
ASKED = "from kernels.doubled import doubled; print(doubled())"


def package_in(folder: Path) -> Path:
    """Return a package whose function calls that of another file, which is not written yet."""
    package = folder / "kernels"
    package.mkdir()
    (package / "__init__.py").touch()
    shutil.copy(compiled.__file__, package)
    (package / "doubled.py").write_text(DOUBLED, encoding="utf-8")
    return package


@pytest.mark.slow
def test_a_changed_function_is_compiled_into_those_that_call_it(tmp_path):
    """The file of the caller does not change, and numba alone would use its cache."""
    package = package_in(tmp_path)
    for second, value in enumerate((3.0, 3.0, 5.0)):
        slope = package / "slope.py"
        slope.write_text(SLOPE.format(value=value), encoding="utf-8")
        # Python recognises a changed file of the same length by the second of its time stamp.
        os.utime(slope, (2 * second, 2 * second))
        ended = subprocess.run(
            [sys.executable, "-c", ASKED],
            cwd=tmp_path,
            env=ENVIRONMENT,
            capture_output=True,
            text=True,
            check=True,
        )
        assert float(ended.stdout) == 2.0 * value
    assert len(list((package / "__pycache__").glob("numba-*"))) == 2


@pytest.mark.slow
def test_of_processes_that_need_a_function_at_once_only_one_compiles_it(tmp_path):
    package = package_in(tmp_path)
    (package / "slope.py").write_text(SLOPE.format(value=2.0), encoding="utf-8")
    command = [sys.executable, "-c", IN_TURN]
    at_once = [
        subprocess.Popen(command, cwd=tmp_path, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    compilations = [int(process.communicate()[0]) for process in at_once]
    assert sorted(compilations) == [0, 0, 1]


def test_kernels_of_joints_are_kept_by_the_version_of_their_package():
    assert compiled.CACHE_FOLDER.name.endswith(compiled.version_of(Path(compiled.__file__).parent))
    assert advance_jenkins.stats.cache_path.startswith(str(compiled.CACHE_FOLDER))
