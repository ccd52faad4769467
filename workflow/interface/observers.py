"""Observers of a model that runs in Python: its progress, and a checkpoint to resume from."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from sa_solver.steps import Steps
from wear.coupled_state import CoupledState, Observer
from workflow.errors import RunChanged, UserError
from workflow.shell.folders.packing import PackingError, packed, unpacked
from workflow.shell.folders.store import DamagedFile, read_arrays, write_arrays

if TYPE_CHECKING:
    from workflow.models.rig.motion import MotionModel
    from workflow.models.vibration.model import VibrationModel

# Name of the array that holds the packed state.
STATE = "state"
# Added to shares, of which the last one may be below 1 by rounding.
ROUNDING = 1e-6


class Progress(Observer):
    """Observer that prints a line for each part of a run, and one after every jump.

    Curves of vibrations and motions in time print a line for every tenth that is computed.

    Parameters
    ----------
    stream : text file, optional
        Where to print; standard error if not given.

    Examples
    --------
    >>> import sys
    >>> import fretscale
    >>> watching = fretscale.Progress(sys.stdout)
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream
        self._tenths = 0

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        self._tenths = 0
        if name != "drift probe":
            self._print(name)
        yield

    def reached(self, share: float) -> None:
        if (tenths := int(10.0 * share + ROUNDING)) > self._tenths:
            self._tenths = tenths
            self._print(f"{10 * tenths} %")

    def jump_finished(self, before: CoupledState, after: CoupledState) -> None:
        self._print(
            f"jump {after.jump}: {after.cycles[-1]:.6g} cycles, "
            f"largest depth {1e3 * after.depth:.4g} um"
        )

    def _print(self, text: str) -> None:
        print(text, file=self._stream or sys.stderr, flush=True)


class Checkpoint(Observer):
    """Observer that writes the state of a run to a file after every jump, to resume from it.

    Vibrations and motions in time have no jumps. Their steps are stored as often as half a percent
    of the time allows, where :meth:`steps` runs them; a second run takes them from the file:
    ``model.run(steps=checkpoint.steps(model))``.

    Parameters
    ----------
    path : path
        The file. It is replaced only when a new state is written in full, so it is never partial.

    Examples
    --------
    The second run continues where the first one ended, or was interrupted:

    >>> import tempfile, fretscale
    >>> folder = tempfile.TemporaryDirectory()
    >>> checkpoint = fretscale.Checkpoint(folder.name + "/state.h5")
    >>> print(checkpoint.state())
    None
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if self.path.is_dir() or not self.path.parent.is_dir():
            raise UserError(
                f"{self.path}: no file can be there; give a file in a folder that exists"
            )

    def jump_finished(self, before: CoupledState, after: CoupledState) -> None:
        data, _ = packed(after)
        write_arrays(self.path, {STATE: np.frombuffer(data, dtype=np.uint8)})

    def state(self) -> CoupledState | None:
        """Return the last state written, or None if there is no file.

        Raises UserError for a file without such a state.
        """
        if not self.path.exists():
            return None
        try:
            arrays, _ = read_arrays(self.path)
            state: CoupledState = unpacked(arrays[STATE].tobytes())
        except DamagedFile as error:
            raise RunChanged(str(error)) from error
        except (KeyError, PackingError) as error:
            raise RunChanged(f"{self.path}: not a state of this version of fretscale") from error
        return state

    def steps(self, model: VibrationModel | MotionModel) -> Steps:
        """Return a runner of the steps of a model, which stores them and takes stored ones.

        Raises UserError for a file of another model, or without steps.
        """
        # Folders of runs take a second to import, and states of wear need none of them.
        from workflow.interface.file_steps import FileSteps

        return FileSteps(self.path, model)
