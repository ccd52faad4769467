"""Command in forked processes that need not import anything, for tests that kill them.

The fork server has only imported what runs need, so that no thread, plan or open file exists twice
after a fork.
"""

import multiprocessing
import os
import sys
from functools import cache
from multiprocessing.process import BaseProcess

# What runs import, with the libraries that they load where they use them.
PRELOADED = [
    "workflow.cli",
    *(
        f"workflow.analyses.{kind}.run"
        for kind in ("specimens", "time", "vibration", "vibration_wear", "wear")
    ),
    *("workflow.pictures.style", "numba", "pyfftw", "pypardiso", "skfem", "scipy.signal"),
]


@cache
def _server() -> multiprocessing.context.ForkServerContext:
    server = multiprocessing.get_context("forkserver")
    server.set_forkserver_preload(PRELOADED)
    return server


def start(words: list[str], share: float, first: float) -> BaseProcess:
    """Run the command with these values of ``steps.SHARE`` and ``steps.FIRST_SAVE``.

    Its output is not shown.
    """
    process = _server().Process(target=_run, args=(words, share, first), daemon=False)
    process.start()
    return process


def _run(words: list[str], share: float, first: float) -> None:
    from workflow.cli import main
    from workflow.shell.folders import steps

    steps.SHARE, steps.FIRST_SAVE = share, first
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    sys.argv = ["fretscale", *words]
    main()
