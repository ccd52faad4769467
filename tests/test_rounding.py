"""Tests of solvers, repeated with another processor's rounding and perturbed matrices."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
# Settings of an x86 processor of 2008: no fused products, other sums, other elementary functions.
# On other processors they have no effect, or a partial one.
OLD_PROCESSOR = {
    "OPENBLAS_CORETYPE": "Prescott",
    "MKL_CBWR": "COMPATIBLE",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX512VL,-AVX2,-AVX,-FMA,-FMA4",
}
PERTURBED = ("-p", "tests.perturbed")


def modules(package, *names):
    """Return the test modules of these names, in whichever folder of the package they are."""
    return [str(next((ROOT / "tests" / package).rglob(f"test_{name}.py"))) for name in names]


# Tests in which comparisons of rounded numbers decide: what touches, sticks or has converged, which
# of equal values is reported, when a step ends. In other tests rounding has no further effect. The
# compiled joints and the branches of vibrations would double the time.
CONTACTS = [
    *modules("sa_solver", "contact", "coupled", "coupled_failures", "friction_limit"),
    *modules("sa_solver", "gross_slip", "hardness", "history"),
    *modules("sa_solver", "normal", "normal_control", "normal_properties", "partial_slip"),
    *modules("sa_solver", "convergence", "subsurface"),
    *modules("sa_solver", "tangential", "tangential_dense", "tangential_loop"),
    *modules("fe_models", "friction", "friction_independent", "joint", "linear_solver"),
    *modules("fe_models", "mortar_contact", "mortar_frames", "reduced_contact"),
]
WEAR = [
    *modules("wear", "coupled", "full_cycle", "jumps", "life", "moving", "steppers", "stepping"),
    *modules("wear", "tilt"),
]
SPECIMENS = modules("workflow", "pad_half_space", "specimens_case")


def run_tests(*arguments, **environment):
    """Run pytest in a separate process, and show its failures."""
    words = [sys.executable, "-m", "pytest", "-q", "--tb=short", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*words, *arguments], cwd=ROOT, env=os.environ | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.long
def test_solvers_do_not_notice_perturbed_matrices():
    run_tests(*PERTURBED, *CONTACTS)


@pytest.mark.slow
@pytest.mark.long
def test_solvers_do_not_notice_another_processor(tmp_path):
    # Code compiled for it goes to a separate cache.
    run_tests(*CONTACTS, *WEAR, *SPECIMENS, **OLD_PROCESSOR, NUMBA_CACHE_DIR=str(tmp_path))
