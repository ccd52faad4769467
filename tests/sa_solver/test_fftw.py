"""pyFFTW loads without what it is not used for, and has it for who asks."""

import subprocess
import sys

CODE = """
import sys
from sa_solver.fftw import load_pyfftw
fftw = load_pyfftw()
assert not {"scipy", "dask", "pyfftw.interfaces"} & set(sys.modules)
import pyfftw
assert pyfftw is fftw
assert pyfftw.interfaces.numpy_fft.rfft([1.0, 2.0])[0] == 3.0
import pyfftw.interfaces.cache
assert pyfftw.interfaces.cache.is_enabled() is False
"""


def test_interfaces_of_pyfftw_are_loaded_when_they_are_asked_for():
    subprocess.run([sys.executable, "-c", CODE], check=True)
