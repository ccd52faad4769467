"""Cells of shell commands whose output comes in one piece; IPython runs this as it starts.

IPython's own passes it on as it comes, and lines that come in two pieces end up as two.
"""

import subprocess

from IPython import get_ipython


def bash(line: str, cell: str) -> None:
    """Run a cell by bash; a command that fails ends it, and the page."""
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
