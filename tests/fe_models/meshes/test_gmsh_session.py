"""Sessions of gmsh leave the process unchanged."""

import os
import signal

import pytest

from fe_models.meshes.gmsh_session import RESET_BY_GMSH, gmsh_model

NUMBERS = [getattr(signal, name) for name in RESET_BY_GMSH if hasattr(signal, name)]


@pytest.fixture(params=[signal.SIG_IGN, lambda number, frame: received.append(number)])
def handler(request):
    """Return a signal handler: ignoring, as after `nohup`, or a program's own."""
    before = {number: signal.signal(number, request.param) for number in NUMBERS}
    yield request.param
    for number, was in before.items():
        signal.signal(number, was)


received = []


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_signals_stay_with_whoever_handled_them(handler):
    received.clear()
    with gmsh_model("nothing"):
        for number in NUMBERS:
            os.kill(os.getpid(), number)
    assert received == ([] if handler is signal.SIG_IGN else NUMBERS)
