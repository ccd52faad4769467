"""Tests of wear at the nodes of a structure alone: balances and finer meshes."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

from sa_solver.types import Array
from tests.conftest import CASES
from wear.contact.nodes import NodalState
from wear.coupled import CoupledWear
from wear.coupled_state import CoupledState
from wear.steps.step_errors import step_errors
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.translation import contact_of, wear_of
from workflow.errors import CaseError
from workflow.kinds import load_case
from workflow.models.contact import last_cycle
from workflow.models.contacts import FaceContacts
from workflow.models.nodal import StructureCycle, nodal_contacts
from workflow.models.structure import StructureLoads
from workflow.shell.folders.packing import packed, unpacked

PLANE = CASES / "dovetail_2d.yaml"
NODES = "contact.method=nodes", "wear.step={kind: second_order}", "contact.grid=[64, 64]"
COARSE = (
    *("mesh.flank_nodes=[13, 11]", "mesh.size=8 mm"),
    *("load_path.increments=[3, 3]", "wear.cycles=1e5"),
)
ALPHA, FRICTION, LOAD = 1e-8, 0.4, 1301.33


@dataclass
class Wearing:
    """Wear loop of a case whose nodes wear."""

    source: StructureLoads
    contacts: FaceContacts
    loop: CoupledWear[NodalState]

    @classmethod
    def of(cls, *overrides: str) -> "Wearing":
        case = load_case(PLANE, (*NODES, *overrides))
        source = loads_of(case)
        assert isinstance(source, StructureLoads)
        wear = wear_of(case)
        contacts = nodal_contacts(partial(contact_of, case), wear, source)
        return cls(source, contacts, CoupledWear(wear.coupled(), source, contacts.wearing))

    def states(self) -> Iterator[CoupledState[NodalState]]:
        state, _ = self.loop.begin(self.source.unworn())
        yield state
        yield from self.loop.march(state)

    def worn(self, state: CoupledState[NodalState]) -> tuple[Array, Array, Array]:
        """Return places along a flank, depth of both bodies there, and pressure at peak load."""
        stage, face = self.contacts.stages[0], self.contacts.states(state)[0]
        x = stage.face.coordinates[:, 0]
        order = np.argsort(x)
        pressure = face.cycle().pressure[self.source.peak]
        return x[order], face.surfaces.depth[order], pressure[order]


@pytest.fixture(scope="module")
def coarse() -> tuple[Wearing, list[CoupledState[NodalState]]]:
    wearing = Wearing.of(*COARSE)
    return wearing, list(wearing.states())


def test_volume_is_energy_and_flanks_wear_alike(coarse) -> None:
    wearing, states = coarse
    (one, two), rows = wearing.contacts.states(states[-1]), states[-1].kinetics[-1]
    assert states[-1].cycles[-1] == 1e5
    for face, (_, _, volume_1, volume_2, energy) in zip((one, two), rows, strict=True):
        assert volume_1 == pytest.approx(ALPHA * energy, rel=1e-12)
        assert volume_2 == pytest.approx(ALPHA * energy, rel=1e-12)
        assert energy == face.energy > 0.0
    np.testing.assert_allclose(rows[0], rows[1], rtol=1e-4)
    errors = step_errors(one, wearing.contacts.stages[0].contact.areas)
    assert errors is not None
    assert max(errors.values()) < 0.01  # wear.tolerance


def test_forces_stay_those_of_the_balance(coarse) -> None:
    """Forces balance also on the cells that are written, which lose no volume."""
    wearing, states = coarse
    faces = wearing.contacts.states(states[-1])
    tractions = [end.tractions for end in wearing.contacts.call(last_cycle, faces)]
    for stage, face, on_cells in zip(wearing.contacts.stages, faces, tractions, strict=True):
        peak, area = wearing.source.peak, stage.grid.cell_area
        assert face.loads.P[peak] == pytest.approx(LOAD, rel=2e-4)
        assert on_cells.pressure[peak].sum() * area == pytest.approx(LOAD, rel=2e-4)
        assert on_cells.shear[peak, 0].sum() * area == pytest.approx(-FRICTION * LOAD, rel=2e-4)
        depth = stage.on_grid(face).depth
        assert depth.sum() * area == pytest.approx(
            stage.contact.volume(face.surfaces.depth), rel=1e-12
        )


def test_a_cycle_dissipates_as_finely_divided_ones_do() -> None:
    """Slip is assigned half before and half after a solved state, or to the mean pressure."""

    def energies(increments: int, peak: int) -> tuple[float, float]:
        wearing = Wearing.of(*COARSE[:2], f"load_path.increments=[{peak}, {increments - peak}]")
        histories = wearing.source.unworn_cycle.histories
        areas = np.concatenate([stage.face.nodal_areas for stage in wearing.contacts.stages])
        cycle = StructureCycle(histories, FRICTION, areas, 1.0)
        by_state = 0.5 * FRICTION * float((cycle.slip * cycle.pressure).sum(axis=0) @ areas)
        return by_state, histories[0].loads.mean_energy

    fine = energies(88, 32)[0]
    by_state, by_increment = energies(11, 4)
    assert by_state == pytest.approx(fine, rel=0.015)
    # Only one flank, as the other is its mirror image except for the mesh.
    assert by_state == pytest.approx(by_increment, rel=1e-4)


def test_a_run_goes_on_from_what_the_disk_keeps(coarse) -> None:
    """Results from a stored state are bitwise equal."""
    _, states = coarse
    middle = unpacked(packed(states[len(states) // 2])[0])
    again = Wearing.of(*COARSE)
    *_, end = again.loop.march(middle)
    (one,), (other,) = end.interfaces, states[-1].interfaces
    np.testing.assert_array_equal(one.surfaces.depth, other.surfaces.depth)
    np.testing.assert_array_equal(end.kinetics, states[-1].kinetics)


@pytest.mark.parametrize(
    "override",
    [
        "wear.step={kind: implicit}",
        "wear.motion=follow",
        "loops={amplitude: 1 um}",
        "friction.evolution={energy: [0, 1], factor: [1, 2]}",
        "load_path.mix=[{share: 0.5}, {share: 0.5}]",
        "fidelity=auto",
    ],
)
def test_settings_without_meaning_where_nodes_wear_are_refused(override: str) -> None:
    with pytest.raises(CaseError, match=override.partition("=")[0].split(".")[0]):
        load_case(PLANE, (*NODES, override))


@pytest.mark.slow
def test_elements_alone_converge() -> None:
    """Depth after 3e5 cycles and inner pressure agree with twice the nodes and increments."""
    found = []
    for finer in (1, 2):
        wearing = Wearing.of(
            f"mesh={{flank_nodes: [{1 + finer * 80}, 35], order: 2}}",
            f"load_path.increments=[{8 * finer}, {14 * finer}]",
        )
        *_, end = wearing.states()
        found.append(wearing.worn(end))
    (x, depth, pressure), (there, *finest) = found
    depths, pressures = (np.interp(x, there, field) for field in finest)
    inner = np.abs(x) < 3.5
    missed = (pressure - pressures)[inner]
    assert np.sqrt(np.mean((depth - depths) ** 2)) < 0.02 * depths.max()
    assert np.sqrt(np.mean(missed**2)) < 0.007 * pressures[inner].mean()
