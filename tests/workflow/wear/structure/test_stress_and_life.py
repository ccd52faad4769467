"""Tests of stress under contacts of a wear run, and of the fretting parameter."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import h5py
import numpy as np
import pytest

from sa_solver import von_mises
from sa_solver.half_space.subsurface import SubsurfaceStress
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, Grid, Material
from tests.marks import slow
from tests.workflow.conftest import contents_of
from tests.workflow.output.shown_files import check_arrays, check_scene
from wear.contact.face_loads import CycleLoads
from wear.contact.link import StructureLink
from wear.contact.tractions import CycleTractions
from wear.cracking.bulk_stress import BulkStress
from workflow.analyses.wear.output.contact_stress import _report_stick
from workflow.messages.warning_kinds import WarningKind
from workflow.models.stress.body_stress import Planes, StressedBody, StressedCycle
from workflow.models.stress.contact_stress import (
    BodyStress,
    ContactMoment,
    InterfaceStress,
    life_maps,
)
from workflow.models.stress.results import StressResults
from workflow.models.stress.settings import Stress
from workflow.shell.output.results import grid_of

FLANKS = ("intrados", "extrados")
BODIES = {1: "disk", 2: "blade"}
METAL = Material(115e3, 0.29)
QUICK = (*("contact.grid=[24, 32]", "wear.cycles=1e4"), "stress={points: 6}")
# Of the pressures of one contact problem solved from two different starts.
SOLVER = 1e-6


def begin(start: Any, folder: Path, *overrides: str) -> Any:
    run = start(folder / "out", *QUICK, *overrides)
    assert run.ending.exit_code == 0, run.ending.stderr
    return run


@pytest.fixture(scope="module")
def normal(start_without_notches: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a run whose slips are the structure's."""
    return begin(start_without_notches, tmp_path_factory.mktemp("normal"))


@pytest.fixture(scope="module")
def full(start_without_notches: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a run with friction of the half-space."""
    return begin(start_without_notches, tmp_path_factory.mktemp("full"), "contact.method=full")


@pytest.fixture(scope="module")
def line(start_without_notches: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a run in plane strain."""
    return begin(start_without_notches, tmp_path_factory.mktemp("line"), "structure.dimension=2")


def peak_traction(file: h5py.File, flank: str, moment: str) -> Array:
    """Return the tractions qx, qy, p that the run recorded at peak load."""
    jump = sorted(file["surfaces"][flank])[0 if moment == "unworn" else -1]
    contact = file["contact"][flank][jump]
    return np.concatenate([contact["shear"][()], contact["pressure"][()][None]])


# --- against direct evaluation ------------------------------------------------------------------


@pytest.mark.parametrize("method", ["normal", slow("full"), "line"])
@pytest.mark.parametrize("moment", ["unworn", "worn"])
def test_section_is_that_of_the_recorded_tractions_and_of_the_structure(request, method, moment):
    """Stress that the structure carries past the contact pulls along its free face."""
    run = request.getfixturevalue(method)
    with h5py.File(run.folder / "results.h5") as file:
        for flank in FLANKS:
            group, grid = file["stress/section"][flank], grid_of(file["grid"][flank])
            depths = group["depths"][()]
            assert depths[[0, -1]] == pytest.approx([0.02, 2.0])
            assert group.attrs["bulk_stress"]
            assert run.summary[flank]["stress"]["bulk"]
            traction = peak_traction(file, flank, moment)
            row = int(np.argmin(np.abs(grid.y[0] - group.attrs["at"])))
            for number, name in BODIES.items():
                solver = SubsurfaceStress(grid, METAL, 1 if number == 1 else 2)
                contact = solver.at_depth(traction, float(depths[0]))[:, :, row]
                recorded = group[f"{moment}/body_{number}/stress"][()]
                carried, scale = recorded[:, :, 0] - contact, np.abs(contact).max()
                assert np.abs(carried[2]).max() < 1e-3 * scale
                assert np.abs(carried[4:]).max() < 1e-2 * scale
                assert carried[0].min() > 0.1 * scale
                reported = run.summary[flank]["stress"]["von_mises"][name][moment]
                equivalent = von_mises(recorded)
                assert reported["value"] == pytest.approx(np.nanmax(equivalent), rel=1e-12)
                assert reported["x"] in grid.x
                assert reported["depth"] in depths
                section = group[f"{moment}/body_{number}"]
                np.testing.assert_allclose(section["von_mises"][()], equivalent, rtol=1e-12)
                assert "past it" in section["stress"].attrs["description"]


def test_summary_has_the_largest_values_of_the_maps(normal: Any) -> None:
    with h5py.File(normal.folder / "results.h5") as file:
        for flank in FLANKS:
            grid, reported = grid_of(file["grid"][flank]), normal.summary[flank]["stress"]
            for number, name in BODIES.items():
                for quantity in ("cracking_parameter", "friction_parameter", "tension"):
                    largest = reported[quantity][name]
                    for moment in ("unworn", "worn"):
                        place = f"stress/life/{flank}/{moment}/body_{number}/{quantity}"
                        values = file[place][()]
                        assert largest[moment]["value"] == values.max() > 0.0
                        # Of several as large, as those at y and -y here, the first.
                        alike = np.argwhere(values >= values.max() * (1.0 - 1e-6))
                        x, y = alike[0]
                        assert largest[moment]["x"] == grid.x[x, 0]
                        assert largest[moment]["y"] == grid.y[0, y]
                    assert largest["ratio"] == largest["worn"]["value"] / largest["unworn"]["value"]


def test_each_body_is_pulled_at_its_end(normal: Any) -> None:
    """At peak load the blade slides along x, so qx < 0: it is pulled at +x, the disk at -x."""
    with h5py.File(normal.folder / "results.h5") as file:
        for flank in FLANKS:
            group = file["stress/section"][flank]
            for number, side in {1: -1.0, 2: 1.0}.items():
                along = group[f"unworn/body_{number}/stress"][0, :, 0]
                assert side * group["along"][int(along.argmax())] > 4.0


def test_wear_takes_the_peaks_off(normal: Any) -> None:
    """Pressure peaks fall at once; stress moves with the edge of the contact and falls less."""
    for flank in FLANKS:
        peaks = normal.summary[flank]["peak_pressure"]
        assert 0.9 < peaks["worn"] / peaks["unworn"] < 0.95
        for name in BODIES.values():
            stress = normal.summary[flank]["stress"]["von_mises"][name]
            assert np.isfinite(stress["worn"]["value"])
            assert peaks["worn"] / peaks["unworn"] - 0.01 < stress["ratio"] < 1.02


# --- balance ------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["normal", slow("full"), "line"])
def test_friction_parameter_integrates_to_the_energy_of_the_cycle(request, method):
    run = request.getfixturevalue(method)
    with h5py.File(run.folder / "results.h5") as file:
        for flank in FLANKS:
            area = grid_of(file["grid"][flank]).cell_area
            energy = run.summary[flank]["energy_per_cycle"]["half_space"]
            if method == "full":
                history = file[f"comparison/{flank}/load_history"]
                energy = float(np.sum(history["Edx"][()] + history["Edy"][()]))
            for number in BODIES:
                parameter = file[f"stress/life/{flank}/unworn/body_{number}/friction_parameter"][()]
                assert parameter.min() >= -1e-9 * parameter.max()
                assert 4.0 * parameter.sum() * area == pytest.approx(energy, rel=1e-9)


# --- symmetry -----------------------------------------------------------------------------------


def reversed_cycle(grid: Grid) -> CycleTractions:
    """Return a pressure even in x and y, sliding back and forth along x, friction 0.5."""
    closed = 1.0 - (grid.x / 0.6) ** 2 - (grid.y / 0.8) ** 2
    pressure = 500.0 * np.sqrt(np.maximum(0.0, closed))
    way = np.array([1.0, -1.0])[:, None, None]
    along = 0.01 * way * np.ones(grid.shape)
    slip = np.stack([along, 0.0 * along], axis=1)
    both = np.stack([pressure, pressure])
    shear = np.stack([-0.5 * way * both, 0.0 * both], axis=1)
    loads = LoadHistory(both.sum(axis=(1, 2)), *np.zeros((7, 2)), sliding=np.ones(2, dtype=bool))
    return CycleTractions(loads, 0.5, both, shear, slip, np.zeros(2))


def maps(
    life: Stress, grid: Grid, body: Literal[1, 2], cycle: CycleTractions, known: np.ndarray
) -> dict[str, Array]:
    """Return maps at the critical distance, under the tractions alone."""
    transfer = SimpleNamespace(inside=np.ones(grid.shape, dtype=bool))
    stage = SimpleNamespace(grid=grid, transfer=transfer, transfer_of=lambda _: transfer)
    stressed = StressedBody(stage, METAL, body)  # type: ignore[arg-type]
    alone = StressedCycle(cycle, CycleLoads(cycle.loads, cycle.slip))
    return dict(life_maps(life, (stressed, alone, None), known))


def test_symmetric_load_fares_both_flanks_alike(normal: Any) -> None:
    """One flank is the mirror image of the other, with y reversed."""
    with h5py.File(normal.folder / "results.h5") as file:
        for place in ("body_1", "body_2"):
            for moment in ("unworn", "worn"):
                one, other = (file[f"stress/life/{f}/{moment}/{place}"] for f in FLANKS)
                for quantity in ("friction_parameter", "tension", "cracking_parameter"):
                    scale = one[quantity][()].max()
                    mirrored = other[quantity][()][:, ::-1]
                    np.testing.assert_allclose(one[quantity], mirrored, atol=SOLVER * scale)


@pytest.mark.parametrize("parameter", ["ruiz", "smith_watson_topper", "findley"])
def test_reversed_sliding_is_alike_in_both_bodies_and_at_both_ends(parameter: str) -> None:
    grid = Grid.covering((2.0, 2.0), (20, 16))
    cycle, life = reversed_cycle(grid), Stress(parameter=parameter)
    known = np.ones(2, dtype=bool)
    name = "cracking_parameter" if parameter == "ruiz" else parameter
    value, of_body_2 = (maps(life, grid, n, cycle, known)[name] for n in (1, 2))
    scale = value.max()
    assert scale > 0.0
    # The search for the worst plane is not symmetric: see wear.cracking.life.PlaneSearch.
    left = 1e-10 if parameter == "ruiz" else 0.02
    np.testing.assert_allclose(of_body_2, value, atol=left * scale)
    np.testing.assert_allclose(value[::-1], value, atol=left * scale)
    np.testing.assert_allclose(value[:, ::-1], value, atol=left * scale)


# --- shear that method normal does not know -----------------------------------------------------


def test_increments_with_unknown_shear_add_work_but_no_stress() -> None:
    grid = Grid.covering((2.0, 2.0), (20, 16))
    cycle, both, one = reversed_cycle(grid), np.array([True, True]), np.array([True, False])
    every, first = (maps(Stress(), grid, 2, cycle, known) for known in (both, one))
    np.testing.assert_array_equal(every["friction_parameter"], first["friction_parameter"])
    # Sliding along x, body 2 is pulled at +x; the tension at -x belongs to the way back.
    assert every["tension"][:6].max() > 10.0 * first["tension"][:6].max()
    assert every["tension"][-6:].max() == pytest.approx(first["tension"][-6:].max())


def test_increments_that_stick_are_in_the_maps(normal: Any) -> None:
    with h5py.File(normal.folder / "results.h5") as file:
        face = file["structure/intrados"]
        pressed, slips = face["pressure"][()] > 0.0, face["slip"][()].any(axis=1)
        stuck = np.sum(pressed & ~slips, axis=1) / np.maximum(1, pressed.sum(axis=1))
        assert stuck.max() > 0.5
        assert file["stress/life/intrados/unworn/left_out"][()].size == 0
    assert normal.summary["intrados"]["stress"]["left_out"] == {"unworn": 0, "worn": 0}
    assert not [w for w in normal.summary["warnings"] if "stress." in w]


class Warnings:
    """Minimal reporter that collects warnings."""

    def __init__(self) -> None:
        self.printed: list[str] = []

    def warn(self, kind: WarningKind, text: str) -> None:
        assert kind is WarningKind.UNKNOWN_SHEAR
        self.printed.append(text)


@pytest.mark.parametrize(("share", "count"), [(0.0, 0), (0.3, 1)])
def test_shear_that_nobody_knows_is_warned_of(share: float, count: int) -> None:
    """At peak load there are two warnings, since the section lacks it too."""
    for increment, more in ((0, 0), (1, count)):
        received: Any = Warnings()
        unknown = np.zeros((2, 3))
        unknown[1, increment] = share
        _report_stick(unknown, 1, received)
        assert [line[:13] for line in received.printed] == (
            ["up to 30 % of"] * more + ["stress.life l"] * count
        )


@pytest.mark.parametrize(
    ("fits", "reported"),
    [([0.01, 0.02], ""), ([0.01, 0.04], "uncertain by 4.0 %"), ([0.01], "too few nodes")],
)
def test_what_is_not_known_of_the_structure_is_warned_of(fits: list[float], reported: str) -> None:
    links = [
        StructureLink(np.zeros((1, 3, 2, 1)), np.zeros((2, 2)), np.array([0.3, q, 0.0]))
        for q in fits
    ]
    carried = tuple(BulkStress(link, METAL, 1) for link in links)
    bodies: Any = {1: BodyStress(None, {}), 2: BodyStress(None, {})}
    moment = ContactMoment(bodies, carried, np.array([]))
    grid = Grid.covering((2.0, 2.0), (4, 4))
    stress = InterfaceStress("a", Planes(Stress(), grid), {"unworn": moment}, np.zeros(1), 0)
    warning = stress.carried_warning
    assert (warning is not None) == bool(reported)
    if warning is not None:
        assert warning.kind is WarningKind.UNCERTAIN_CARRIED_STRESS
        assert reported in warning.text


@pytest.mark.parametrize("stuck", [0.0, 0.3])
def test_a_model_names_shear_that_nobody_knows(stuck: float) -> None:
    planes = Planes(Stress(), Grid.covering((2.0, 2.0), (4, 4)))
    stress = InterfaceStress("a", planes, {}, np.array([0.0, stuck]), 0)
    for peak in (0, 1):
        kinds = [fault.kind for fault in StressResults(None, [stress]).faults(peak)]
        assert kinds == [WarningKind.UNKNOWN_SHEAR] * (stuck > 0.0)


# --- settings -----------------------------------------------------------------------------------


def test_switched_off_it_leaves_nothing(start: Any, tmp_path: Path) -> None:
    off = "stress.section=none", "stress.life.parameter=none"
    run = begin(start, tmp_path, "structure.dimension=2", *off)
    assert "stress" not in run.summary["intrados"]
    with h5py.File(run.folder / "results.h5") as file:
        assert "stress" not in file


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (
            ["stress.at=31 mm"],
            "stress.at: 31 mm is outside the contact's grid; allowed: -30 to 30 mm",
        ),
        (["stress.depth=10 um"], "allowed: above life.depth, 0.02 mm"),
        (["structure.dimension=2", "stress.section=y"], "a line contact has no length along y"),
    ],
    ids=["off the grid", "no depth", "line along y"],
)
def test_sections_that_cannot_be_are_refused(start, tmp_path, overrides, words):
    run = start(tmp_path / "out", *QUICK, *overrides)
    assert run.ending.exit_code == 2
    assert words in " ".join(run.ending.stderr.split())


@pytest.mark.parametrize("axis", ["x", "y"])
def test_section_lies_where_it_says(axis: str) -> None:
    grid = Grid.covering((2.0, 3.0), (10, 12))
    settings = Stress(axis, at=0.33)
    planes, centres = Planes(settings, grid), (grid.x.ravel(), grid.y.ravel())
    along, across = centres if axis == "x" else centres[::-1]
    np.testing.assert_array_equal(planes.along, along)
    assert planes.at in across
    assert abs(planes.at - 0.33) <= 0.5 * np.diff(across)[0]
    assert np.all(np.diff(planes.depths, 2) > 0.0)


# --- pictures -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def paraview(normal: Any) -> Path:
    from workflow.analyses.wear.paraview.wear import write_wear

    folder = normal.folder / "shown"
    folder.mkdir()
    with h5py.File(normal.folder / "results.h5") as file:
        write_wear(contents_of(normal.folder), file, folder)
    return folder


def test_maps_are_on_the_flanks(normal: Any, paraview: Path) -> None:
    import pyvista

    check_arrays(paraview)
    check_scene(paraview / "view.py")
    with h5py.File(normal.folder / "results.h5") as file:
        reader = pyvista.PVDReader(paraview / "life_intrados.pvd")
        assert reader.time_values == file["kinetics/cycles"][()][[0, -1]].tolist()
        for moment in ("unworn", "worn"):
            mesh = pyvista.read(paraview / "life" / f"intrados_{moment}.vtp")
            x, y, _ = local_points(mesh, file["grid/intrados"]).T
            grid = grid_of(file["grid/intrados"])
            rows, columns = (
                np.searchsorted(axis.ravel() + 1e-4, at) for axis, at in ((grid.x, x), (grid.y, y))
            )
            for number in BODIES:
                tension = file[f"stress/life/intrados/{moment}/body_{number}/tension"][()]
                shown = mesh.point_data[f"tension_{number} [MPa]"]
                np.testing.assert_allclose(shown, tension[rows, columns], rtol=1e-6)


def local_points(mesh: Any, grid: h5py.Group) -> np.ndarray:
    """Return points of a mesh in the interface frame."""
    return (mesh.points - grid.attrs["origin"]) @ grid.attrs["axes"].T


def test_sections_sit_under_and_above_the_flank(normal: Any, paraview: Path) -> None:
    """They lie within the body, with stress along the face and the global axes."""
    import pyvista

    with h5py.File(normal.folder / "results.h5") as file:
        axes, group = file["grid/extrados"].attrs["axes"], file["stress/section/extrados"]
        along, depths = np.meshgrid(group["along"], group["depths"], indexing="ij")
        for number, side in {1: -1.0, 2: 1.0}.items():
            mesh = pyvista.read(paraview / "section" / f"extrados_worn_{number}.vtu")
            x, y, z = local_points(mesh, file["grid/extrados"]).T
            stress = group[f"worn/body_{number}/stress"][()]
            inside = np.isfinite(stress).all(axis=0)
            assert 0 < mesh.n_points <= np.count_nonzero(inside)
            np.testing.assert_allclose(y, group.attrs["at"], atol=1e-4)
            rows, columns = (
                np.abs(axis[None, :] - at[:, None]).argmin(axis=1)
                for axis, at in ((group["along"][()], x), (group["depths"][()], side * z))
            )
            # Points 250 mm from the origin in single precision.
            np.testing.assert_allclose(x, along[rows, columns], atol=1e-4)
            np.testing.assert_allclose(side * z, depths[rows, columns], atol=1e-4)
            expected = stress[:, rows, columns]
            shown = mesh.point_data["face_stress [MPa]"].T
            np.testing.assert_allclose(shown, expected, rtol=1e-5, atol=1e-4)
            # Stress on the planes of the face's normal, found either way.
            xx, yy, zz, xy, yz, zx = mesh.point_data["stress [MPa]"].T
            tensor = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
            turned = np.einsum("ai,ijn,bj->abn", axes, tensor, axes)
            np.testing.assert_allclose(turned[2, 2], expected[2], atol=1e-3)
            np.testing.assert_allclose(turned[2, 0], expected[5], atol=1e-3)
