"""Notebook cells of shell commands with their output in one piece; IPython runs this at its start.

IPython's built-in cell passes output on as it arrives, and splits lines that arrive in two pieces.
"""

import subprocess

from IPython import get_ipython


def bash(line: str, cell: str) -> None:
    """Run a cell in bash; a command that fails ends the cell and the page."""
    done = subprocess.run(
        ["bash", "-ec", cell],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    print(done.stdout, end="")  # noqa: T201
    done.check_returncode()


get_ipython().register_magic_function(bash, "cell")
