"""Results of a wear model as a tree of labelled arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from wear.contact.contacts import KINETICS
from wear.contact.face_loads import FaceLoads
from wear.contact.tractions import ContactFields
from wear.coupled_state import CoupledState, Observer
from wear.steps.step_errors import step_errors
from wear.surfaces import Surfaces
from workflow.layout.declared import GRID, Declared, declared
from workflow.models.contact import FaceContact, FaceState
from workflow.models.contacts import FaceContacts
from workflow.models.stress.results import StressResults

if TYPE_CHECKING:
    import xarray as xr


COORDINATES = declared(f"""{GRID}
    cycles | 1 | cycles | load cycles so far
""")
FIELDS = declared("""
    gap | mm | x y | between the unloaded, unworn bodies
    depth_1, depth_2 | mm | cycles x y | worn off body #
    pressure | MPa | cycles x y | at peak load
    shear | MPa | cycles component x y | on body 2 at peak load
    slip | mm | cycles component x y | slip of body 2 in the increment of peak load
""")
SCALARS = declared("""
    largest_depth_1, largest_depth_2 | mm | cycles | largest depth worn off body #
    volume_1, volume_2 | mm^3 | cycles | worn off body #
    energy | N mm | cycles | dissipated so far
""")
RESULTANTS = declared("""
    P | N | state increment | normal force, positive where the bodies are pressed together
    Qx | N | state increment | force on body 2 along x
    Qy | N | state increment | force on body 2 along y
    Mx | N mm | state increment | moment on body 2 about x
    My | N mm | state increment | moment on body 2 about y
    Mz | N mm | state increment | moment on body 2 about z
""")
RUN = declared("drift | 1 | cycles | change of the resultants after each jump, relative")


@dataclass
class ResultsRecorder(Observer):
    """Recorder of surfaces, and of tractions at the increment ``peak``, after every jump."""

    contacts: FaceContacts
    peak: int
    cycles: list[float] = field(default_factory=list)
    surfaces: list[list[Surfaces]] = field(default_factory=list)
    fields: list[list[ContactFields]] = field(default_factory=list)

    def begin(self, state: CoupledState[Any]) -> None:
        self._record(state)

    def jump_finished(self, before: CoupledState[Any], after: CoupledState[Any]) -> None:
        self._record(after)

    def _record(self, state: CoupledState[Any]) -> None:
        faces = self.contacts.faces(state)
        self.cycles.append(float(state.cycles[-1]))
        self.surfaces.append([contact.on_grid(of_face) for contact, of_face in faces])
        self.fields.append(self.contacts.fields(state, self.peak))


@dataclass(frozen=True)
class WearResults:
    """Results of a run, from its recorder and its ``state`` at the end.

    The tree has a group for each contact face, by its name: fields over ``x`` and ``y`` of the face
    after every jump (``cycles``), depths, volumes and energy, and the resultants of the closed
    cycle, ``unworn`` and at the end (``state``). In a ``line`` contact forces, moments, energies
    and volumes are per length. Attributes of a face are the relative errors of depth and volume due
    to the wear steps; ``fretscale.error_budget`` estimates what mesh, grid and increments
    leave.
    The groups of ``stress`` are added, if there is any.
    """

    recorder: ResultsRecorder
    state: CoupledState[Any]
    unworn: Sequence[FaceLoads]
    line: bool
    stress: StressResults | None = None

    def tree(self) -> xr.DataTree:
        """Return the results as a tree of labelled arrays."""
        import xarray as xr

        worn = self.recorder.contacts.faces(self.state)
        faces = {
            contact.name: self._face(number, contact, state)
            for number, (contact, state) in enumerate(worn)
        }
        run = xr.Dataset(
            {"drift": self._variable(RUN["drift"], self._recorded(self.state.drift))},
            coords={"cycles": self._cycles()},
            attrs={"solutions_of_the_loads": self.state.solutions, "per_length": int(self.line)},
        )
        further = {} if self.stress is None else self.stress.groups()
        return xr.DataTree.from_dict({"/": run, **faces, **further})

    def _face(self, number: int, contact: FaceContact, state: FaceState) -> xr.Dataset:
        """Return the results of one contact face."""
        import xarray as xr

        grid = contact.grid
        surfaces = [at[number] for at in self.recorder.surfaces]
        fields = [at[number] for at in self.recorder.fields]
        arrays = {
            "gap": surfaces[0].initial_gap,
            "depth_1": np.stack([at.depth_1 for at in surfaces]),
            "depth_2": np.stack([at.depth_2 for at in surfaces]),
            "pressure": np.stack([at.pressure for at in fields]),
            "shear": np.stack([at.shear for at in fields]),
            "slip": np.stack([at.slip for at in fields]),
        }
        rows = self._recorded(self.state.kinetics)[:, number]
        loads = [self.unworn[number].loads, state.loads]
        variables = {name: self._variable(FIELDS[name], array) for name, array in arrays.items()}
        variables |= {
            name: self._variable(SCALARS[name], rows[:, column])
            for column, name in enumerate(SCALARS)
        }
        variables |= {
            name: self._variable(RESULTANTS[name], _both(loads, name)) for name in RESULTANTS
        }
        coordinates = {
            "cycles": self._cycles(),
            "x": self._variable(COORDINATES["x"], grid.x.ravel()),
            "y": self._variable(COORDINATES["y"], grid.y.ravel()),
            "component": ("component", ["x", "y"]),
            "state": ("state", ["unworn", "worn"]),
        }
        # Relative errors of depth and volume due to the wear steps, where known.
        errors = step_errors(state, contact.contact.areas) or {}
        by_steps = {f"{name}_error_by_steps": error for name, error in errors.items()}
        return xr.Dataset(variables, coords=coordinates, attrs=by_steps)

    def _recorded(self, of_all_jumps: Array) -> Array:
        """Return the rows of the jumps that were recorded; for a resumed run, the last ones."""
        return of_all_jumps[-len(self.recorder.cycles) :]

    def _cycles(self) -> xr.Variable:
        return self._variable(COORDINATES["cycles"], np.array(self.recorder.cycles))

    def _variable(self, variable: Declared, values: Array) -> xr.Variable:
        return variable.variable(values, self.line)


def _both(loads: Sequence[LoadHistory], name: str) -> Array:
    """Return a resultant of the unworn and the worn cycle ``(2, t)``."""
    return np.stack([getattr(history, name) for history in loads])


assert len(SCALARS) == len(KINETICS)
