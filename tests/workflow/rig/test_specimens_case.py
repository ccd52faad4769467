"""Tests of cases of rig specimens: files, closed forms, balances, and refusals."""

import json

import h5py
import numpy as np
import pytest

from fe_models.joints.reduction import free_frequencies, load_reduced
from sa_solver.reference.hertz import HertzSphere
from sa_solver.types import ElasticPair, Material
from tests.workflow.command_line import command
from tests.workflow.conftest import manifest_has_all
from tests.workflow.output.shown_files import check_arrays, check_scene, total
from wear.contact.link import LARGEST_RESIDUAL
from workflow.analyses.specimens.model import reduced_pair
from workflow.errors import CaseError
from workflow.kinds import parse_case

STEEL = Material(200e3, 0.3)
ALPHA = 1.5e-9
# Tolerance for the solver and its bookkeeping.
SOLVER = 1e-9
SMALL = """\
title: Small pair
analysis: wear
structure:
  kind: specimens
  diameter: 8 mm
  length: 33 mm
  strip_width: 1 mm
  chamfer_depth: 1 mm
  ring_distance: 2 mm
  form: {along: 1000 mm, across: 50 mm}
materials:
  body_1: {young: 200 GPa, poisson: 0.3, density: 7800 kg/m^3}
  body_2: {young: 200 GPa, poisson: 0.3, density: 7800 kg/m^3}
friction: {coefficient: 0.88}
load_path: {normal_forces: [87 N, 250 N], stroke: 14 um}
mesh: {pad_elements: 6, size: 3 mm}
reduction: {modes: 20}
contact: {grid: [24, 24]}
wear:
  law: energy
  body_1: {coefficient: 1500 um^3/J}
  body_2: {coefficient: 3000 um^3/J}
  energy: 1.2 kJ
  reported:
    - {normal_force: 87 N, steady: stiffness, cycles: 1e5}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with small cases and runs; reduced models share a separate cache."""
    folder = tmp_path_factory.mktemp("specimens")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FRETSCALE_CACHE", str(folder / "cache"))
        (folder / "small.yaml").write_text(SMALL, encoding="utf-8")
        yield folder


def run(folder, name, *overrides):
    """Return the folder of a run with overrides."""
    quiet = () if name == "pictured" else ("output.paraview=false", "output.figures=false")
    result = command(
        "run", folder / "small.yaml", "--out", folder / name, overrides=[*quiet, *overrides]
    )
    assert result.exit_code == 0, result.stderr
    return folder / name


def summary_of(folder):
    text = (folder / "summary.json").read_text(encoding="utf-8")
    assert "NaN" not in text
    assert "Infinity" not in text
    return json.loads(text)


@pytest.fixture(scope="module")
def curved(folder):
    return run(folder, "curved")


@pytest.fixture(scope="module")
def pictured(folder, curved):
    """Return the same run with its pictures."""
    return run(folder, "pictured")


@pytest.fixture(scope="module")
def summary(curved):
    return summary_of(curved)


@pytest.fixture(scope="module")
def flat(folder, curved):
    """Return flat specimens, worn for some cycles, with the reduced models of the curved pair."""
    overrides = "structure.form=null", "wear.energy=null", "wear.cycles=3e5"
    return run(folder, "flat", *overrides)


class TestSummary:
    def test_reduced_frequencies_come_from_above(self, summary):
        frequencies = summary["frequencies"]["body_1"]
        full, reduced = np.array(frequencies["full"]), np.array(frequencies["reduced"])
        assert np.all(reduced >= full * (1.0 - SOLVER))
        np.testing.assert_allclose(reduced, full, rtol=0.02)
        # Both specimens are one turned about.
        turned = summary["frequencies"]["body_2"]["reduced"]
        np.testing.assert_allclose(turned, reduced, rtol=1e-6)

    def test_volumes_are_coefficients_times_energy(self, summary):
        for load in summary["loads"]:
            expected = np.array([ALPHA, 2.0 * ALPHA]) * load["energy"]
            np.testing.assert_allclose(load["volumes"], expected, rtol=SOLVER)
            # The last cycle block is a whole one.
            assert 1.2e6 <= load["energy"] < 1.3e6

    def test_curved_pads_wear_into_full_contact(self, summary):
        for load in summary["loads"]:
            assert load["unworn"]["area"] < 0.75
            assert load["worn"]["area"] == pytest.approx(1.0)
            assert load["worn"]["stick_stiffness"] > 1.3 * load["unworn"]["stick_stiffness"]
            assert load["worn"]["pressure_deviation"] < 0.2 * load["unworn"]["pressure_deviation"]
        stiff, stiffer = (load["unworn"]["stick_stiffness"] for load in summary["loads"])
        assert stiff < stiffer
        one, other = (load["worn"]["stick_stiffness"] for load in summary["loads"])
        assert one == pytest.approx(other, rel=SOLVER)

    def test_cycles_spread_more_than_energies(self, summary):
        spread = summary["collapse"]
        assert spread["cycles"] > 2.0 > spread["energy"] > 1.0

    def test_linked_half_space_sticks_as_the_specimens(self, summary):
        """The pad is worn into full contact; the half-space alone is 5 % stiffer."""
        worn = summary["loads"][0]["worn"]
        assert worn["half_space"]["area"] == pytest.approx(1.0)
        exact, tied = worn["stick_stiffness"], summary["tied_pad"]["tangential"]
        assert worn["half_space"]["stick_stiffness"] == pytest.approx(exact, rel=0.02)
        assert tied["half_space"] > 1.04 * tied["specimens"]
        assert worn["half_space"]["energy_per_cycle"] == pytest.approx(
            worn["energy_per_cycle"], rel=2e-3
        )
        assert 0.0 < worn["half_space"]["link_misfit"] < LARGEST_RESIDUAL

    def test_half_space_of_the_unworn_pair_is_hertzs(self, summary):
        hertz = HertzSphere(87.0, 1000.0 * 50.0 / 1050.0, ElasticPair(STEEL, STEEL).contact_modulus)
        half_space = summary["loads"][0]["unworn"]["half_space"]
        # First order in a cell over the contact radius, 1/7.
        assert half_space["approach"] == pytest.approx(hertz.approach, rel=5e-3)
        assert half_space["peak_pressure"] == pytest.approx(hertz.peak_pressure, rel=3e-2)
        area = np.pi * hertz.contact_radius**2
        assert half_space["area"] == pytest.approx(area, rel=0.1)

    def test_uncoupled_cycle_is_close_to_the_coupled_one(self, summary):
        for load in summary["loads"]:
            assert abs(load["coupled_cycle"]["energy_difference"]) < 5e-3
            assert abs(load["coupled_cycle"]["secant_stiffness_difference"]) < 1e-2

    @pytest.mark.slow
    def test_coefficient_that_a_source_would_have_had(self, folder, curved, summary):
        """With this coefficient the pair is steady after the cycles that the source reports."""
        (reported,) = summary["reported"]
        one, other = reported["coefficients"]
        again = summary_of(
            run(
                folder,
                "reported",
                f"wear.body_1.coefficient={one}",
                f"wear.body_2.coefficient={other}",
                "load_path.normal_forces=[87 N]",
            )
        )
        (load,) = again["loads"]
        assert load["steady"]["stiffness"]["cycles"] == pytest.approx(1e5, rel=1e-6)
        # The same volume is worn off by less energy.
        volume = ALPHA * summary["loads"][0]["steady"]["stiffness"]["energy"]
        assert one * load["steady"]["stiffness"]["energy"] == pytest.approx(volume, rel=1e-6)

    def test_flat_pads_stay_in_full_contact(self, flat):
        for load in summary_of(flat)["loads"]:
            assert load["cycles"] == 3e5
            unworn, worn = load["unworn"], load["worn"]
            assert unworn["area"] == worn["area"] == pytest.approx(1.0)
            # Even but for the slip, which at 250 N is not quite.
            assert worn["pressure_deviation"] < 0.2 * unworn["pressure_deviation"]
            # Stuck it stays as stiff; pressure that is even lets the edges slip earlier.
            assert worn["stick_stiffness"] == pytest.approx(unworn["stick_stiffness"], rel=SOLVER)
            assert 0.9 < worn["secant_stiffness"] / unworn["secant_stiffness"] < 0.999
        # Steady from the start: no coefficient changes that.
        assert summary_of(flat)["reported"][0]["coefficients"] is None
        assert summary_of(flat)["collapse"] is None

    def test_reduced_models_are_found_again(self, folder, curved, flat):
        assert "from the cache" in (flat / "run.log").read_text(encoding="utf-8")
        frequencies, other = (summary_of(path)["frequencies"] for path in (curved, flat))
        assert frequencies == other


class TestResults:
    def test_every_dataset_has_a_unit_and_a_description(self, curved):
        seen = []

        def look(name, item):
            if isinstance(item, h5py.Dataset):
                assert item.attrs["unit"]
                assert item.attrs["description"]
                seen.append(name)

        with h5py.File(curved / "results.h5") as file:
            file.visititems(look)
        assert len(seen) > 50

    def test_energy_is_that_of_the_cycles(self, curved):
        with h5py.File(curved / "results.h5") as file:
            history = file["loads/0/kinetics"]
            steps = np.diff(history["cycles"]) * history["energy_per_cycle"][:-1]
            np.testing.assert_allclose(np.diff(history["energy"]), steps, rtol=SOLVER)

    def test_area_of_the_loop_is_the_energy_of_a_cycle(self, curved):
        with h5py.File(curved / "results.h5") as file:
            load = file["loads/1"]
            for place, state in ((0, "00000"), (-1, list(load["states"])[-1])):
                loop = load["states"][state]["loop"]
                area = abs(np.trapezoid(loop["ring_force"], loop["ring_displacement"]))
                # Second order in the points of first loading.
                energy = load["kinetics/energy_per_cycle"][place]
                assert area == pytest.approx(energy, rel=2e-3)

    def test_worn_depth_wears_where_energy_is(self, curved):
        """Body 2 has twice the coefficient of body 1, everywhere."""
        with h5py.File(curved / "results.h5") as file:
            *_, last = file["loads/0/states"].values()
            np.testing.assert_allclose(last["worn_2"], 2.0 * last["worn_1"][()], rtol=1e-12)

    def test_reduced_models_are_kept(self, curved, summary):
        model = load_reduced(curved / "reduced" / "body_2.h5")
        frequencies = free_frequencies(model.stiffness, model.mass, 12)[6:]
        expected = summary["frequencies"]["body_2"]["reduced"]
        np.testing.assert_allclose(frequencies, expected, rtol=1e-9)

    @pytest.mark.slow
    def test_figures(self, pictured):
        from matplotlib.image import imread

        assert manifest_has_all(pictured)
        names = {"pad", "loops", "kinetics", "half_space"}
        assert {path.stem for path in (pictured / "figures").iterdir()} == names
        for path in (pictured / "figures").iterdir():
            assert np.any(imread(path)[..., :3] < 0.95, axis=-1).mean() > 0.02

    @pytest.mark.slow
    def test_paraview(self, pictured):
        import pyvista

        reader = pyvista.get_reader(pictured / "paraview" / "load_1.pvd")
        with h5py.File(pictured / "results.h5") as file:
            load, pad = file["loads/1"], file["specimens/pad/coordinates"][()]
            cycles = [state.attrs["cycles"] for state in load["states"].values()]
            np.testing.assert_allclose(reader.time_values, cycles)
            reader.set_active_time_value(reader.time_values[-1])
            mesh = reader.read()[0]
            np.testing.assert_allclose(mesh.points[:, :2], pad, atol=1e-6)
            *_, last = load["states"].values()
            np.testing.assert_allclose(mesh["pressure [MPa]"], last["pressure"], rtol=1e-6)
            assert mesh.area == pytest.approx(1.0)
            force = load.attrs["normal_force"]
            assert total(mesh, "pressure [MPa]") == pytest.approx(force, rel=1e-6)
            for body in (1, 2):
                volume = load[f"kinetics/volume_{body}"][-1]
                assert total(mesh, f"depth_{body} [mm]") == pytest.approx(volume, rel=1e-6)
            normal = file["grid/pad"].attrs["axes"][2]
            for body, into in {1: -1.0, 2: 1.0}.items():
                worn = mesh[f"worn_{body} [mm]"] @ normal
                np.testing.assert_allclose(worn, into * last[f"worn_{body}"][()], rtol=1e-6)
        check_arrays(pictured / "paraview")
        check_scene(pictured / "paraview" / "view.py")


class TestCase:
    @pytest.mark.parametrize(
        ("override", "message"),
        [
            ("load_path.normal_forces=[17, 17]", "17 N: given twice"),
            ("structure.strip_width=6 mm", "must be wider than 0 and lie within the diameter"),
            ("structure.chamfer_depth=3 mm", "grow in this order"),
            ("structure.ring_nodes=15", "give a multiple of 4"),
            ("structure.form.across=0.1 mm", "must exceed half of strip_width"),
            ("mesh.pad_elements=9", "odd; allowed: even numbers"),
            ("wear.cycles=1e5", "both given; allowed: either cycles or energy"),
            ("wear.energy=null", "neither given"),
            ("wear.reported.0.normal_force=18 N", "not run; allowed: 87, 250 N"),
        ],
    )
    def test_nonsense_is_one_line(self, override, message):
        with pytest.raises(CaseError) as error:
            parse_case(SMALL, "small.yaml", [override])
        assert message in str(error.value)
        assert "\n" not in str(error.value)

    @pytest.mark.parametrize(
        ("overrides", "message"),
        [
            (["wear.step.cycles=1e7"], "wear.step.cycles: steps of 1e+07 cycles"),
            (["wear.step.cycles=1"], "more than 20000 cycle blocks"),
            (["load_path.stroke=1e-9 mm"], "nothing slides at 87 N"),
            (["load_path.normal_forces.1=1e-6 N"], "only one node of the pad touches"),
        ],
    )
    def test_wear_that_cannot_be_is_one_line(self, folder, curved, overrides, message):
        out = folder / "refused"
        result = command("run", folder / "small.yaml", "--out", out, "--force", overrides=overrides)
        assert result.exit_code == 2
        assert message in result.stderr
        assert not (out / "summary.json").exists()

    def test_no_friction_does_not_wear(self, folder, curved):
        out = run(folder, "smooth", "friction.coefficient=0", "wear.energy=null", "wear.cycles=1e5")
        for load in summary_of(out)["loads"]:
            assert load["energy"] == 0.0
            assert load["volumes"] == [0.0, 0.0]
            assert load["cycles"] == 1e5


# --- surfaces as measured -------------------------------------------------------------------------


def as_scans(folder, name, heights):
    """Write heights [mm] of a specimen along and across its strip, as a scan of either."""
    np.save(folder / f"{name}.npy", heights)
    scan = {"file": f"{name}.npy", "unit": "mm", "level": "none", "pitch": ["10 um", "10 um"]}
    return {"body_1": scan, "body_2": scan | {"angle": "90 deg"}}


def model_of(folder, surfaces, *overrides):
    changes = [f"structure.surfaces={surfaces}", "structure.form=null", *overrides]
    case = parse_case(SMALL, str(folder / "small.yaml"), changes)
    return case.pad_grid, reduced_pair(case)


def test_scans_of_specimens_lie_as_their_strips_do(folder):
    """For planes, body 2 is body 1 turned about x = y, which swaps along and across."""
    u, v = np.meshgrid(*2 * [(np.arange(120) - 59.5) * 0.01], indexing="ij")
    surfaces = as_scans(folder, "plane", 1e-3 * u + 3e-3 * v)
    only = ({"body_1": surfaces["body_1"]}, {"body_2": surfaces["body_2"]})
    for given, (along_x, along_y) in zip(only, ((1e-3, 3e-3), (3e-3, 1e-3)), strict=True):
        grid, model = model_of(folder, given)
        face = model.face
        expected = -along_x * grid.x - along_y * grid.y
        np.testing.assert_allclose(model.gap(grid), expected, atol=1e-12)
        # Eight cells a facet, of a sixth of a mm.
        expected = -(face.coordinates @ [along_x, along_y])
        np.testing.assert_allclose(face.gap, expected, atol=4e-3 / 6 / 128)


@pytest.mark.slow
def test_a_form_from_scans_of_specimens_is_the_form(folder):
    """Radii along and across each strip agree better the finer the pad's squares."""

    def sagitta(x, radius):
        return x**2 / (radius + np.sqrt(radius**2 - x**2))

    u = (np.arange(120) - 59.5) * 0.01
    surfaces = as_scans(folder, "form", -np.add.outer(sagitta(u, 1000.0), sagitta(u, 50.0)))
    off = []
    for squares in (6, 12):
        finer = f"mesh={{pad_elements: {squares}, size: 4 mm, order: 1}}", "reduction.modes=2"
        grid, scanned = model_of(folder, surfaces, *finer)
        formed = reduced_pair(parse_case(SMALL, str(folder / "small.yaml"), finer))
        exact = formed.pair.normal(formed.face.gap, 250.0).pressure
        found = scanned.pair.normal(scanned.face.gap, 250.0)
        # The reduced models do not know of the form.
        assert scanned.from_cache
        assert found.force.sum() == pytest.approx(250.0, rel=SOLVER)
        off.append(np.abs(found.pressure - exact).max() / exact.max())
    assert off[0] < 0.02
    assert off[1] < 0.6 * off[0]
    half_space = scanned.gap(grid) - formed.gap(grid)
    # Means of cells and of points against their middles: pitch²/24 R each, of all radii.
    expected = (grid.pitch[0] ** 2 - 0.01**2) / 24.0 * 2.0 * (1.0 / 1000.0 + 1.0 / 50.0)
    np.testing.assert_allclose(half_space, expected, rtol=1e-3)
