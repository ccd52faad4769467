"""Steps of a model in Python that are stored in one file, so that an interrupted run can resume."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workflow.errors import RunChanged, UserError
from workflow.models.checks.digest import content_digest
from workflow.shell.folders.steps import Place, StoredSteps, joined, outermost, unjoined
from workflow.shell.folders.store import DamagedFile, read_arrays, write_arrays

# Groups of the finished steps and of the states that marches have reached, and the attribute with
# the digest of the model.
FINISHED, MARCHES, MODEL = "finished/", "marches/", "model"


class FileSteps(StoredSteps):
    """Steps of a ``model`` in the file ``path``.

    Raises UserError for a file of another model, or without steps.
    """

    def __init__(self, path: Path, model: object) -> None:
        self._path, self._model = path, content_digest(model)
        self._earlier, marches = self._stored()
        super().__init__(dict(self._earlier), marches)

    def _stored(self) -> tuple[dict[Place, bytes], dict[Place, bytes]]:
        """Return the finished steps of the file, and the states of its marches."""
        if not self._path.exists():
            return {}, {}
        try:
            arrays, attributes = read_arrays(self._path)
            if attributes[MODEL] != self._model:
                raise RunChanged(f"{self._path}: of another model; remove it, or name another file")
            finished, marches = (_unjoined(arrays, group) for group in (FINISHED, MARCHES))
        except DamagedFile as error:
            raise RunChanged(str(error)) from error
        except KeyError as error:
            raise self._of_another_version(error) from error
        return outermost(finished, marches), marches

    def _write(self) -> None:
        finished = outermost(self._earlier | self._new, self._marches)
        groups = {FINISHED: finished, MARCHES: self._marches}
        arrays = {
            group + name: array
            for group, steps in groups.items()
            for name, array in joined(steps).items()
        }
        write_arrays(self._path, arrays, {MODEL: self._model})

    def _of_another_version(self, wrong: object) -> UserError:
        return RunChanged(f"{self._path}: not the steps of this version of fretscale ({wrong})")


def _unjoined(arrays: Mapping[str, Any], group: str) -> dict[Place, bytes]:
    """Return the steps of one group of a file."""
    named = {name.removeprefix(group): a for name, a in arrays.items() if name.startswith(group)}
    return unjoined(named)
