"""pyFFTW loads without the interfaces that are not used, and provides them on access."""

import subprocess
import sys

CODE = """
import sys
from sa_solver.transforms.fftw import load_pyfftw
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


AT_ONCE = """
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from sa_solver.transforms.fftw import load_pyfftw
start = Barrier(4)
def loaded(_):
    start.wait()
    return load_pyfftw().zeros_aligned(3).size
assert list(ThreadPoolExecutor(4).map(loaded, range(4))) == [3] * 4
"""


def test_threads_that_are_the_first_to_ask_wait_for_each_other():
    subprocess.run([sys.executable, "-c", AT_ONCE], check=True)
