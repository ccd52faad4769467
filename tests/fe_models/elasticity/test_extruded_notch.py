"""Local models along extruded bodies: without Poisson's ratio they are those of the section."""

import numpy as np
import pytest

from fe_models.dovetail import Mission, dovetail_structure
from fe_models.joints.face_traction import FaceTraction
from fe_models.notch_stress import extruded_notch_models, notch_models
from sa_solver.types import Material

LOOSE = Material(115e3, 0.0, 4.43e-9)
MISSION = Mission(22, 8, 600.0, 0.8e-3, 400.0, 30e3)


def squeezed(interface):
    """Return a pressure on the ends of the flank and as much tension in its middle."""
    x = interface.coordinates[:, 0]
    ends = np.unique(x.round(9))
    square = ends**2 - np.trapezoid(ends**2, ends) / np.ptp(ends)
    traction = np.zeros((1, 3, len(x)))
    traction[0, 2] = 10.0 * np.interp(x, ends, square)
    return FaceTraction(interface, traction)


@pytest.fixture
def section(dovetail):
    """Return the section of a dovetail on few curved elements of second order."""
    mesh = dovetail.mesh((4, 3), dovetail.flank_width, 2, 12, growth=0.7, curved=True)
    return dovetail_structure(dovetail, mesh, LOOSE, LOOSE, MISSION, 2)


def test_sections_of_loose_material_are_all_alike(dovetail, section):
    """Loads without force or moment are even along the slot: a slice does not feel the next one."""
    space = dovetail.mesh((5, 3), dovetail.flank_width, 3, 8)
    plane = dovetail.mesh((5, 3), dovetail.flank_width, 2, 8)
    amplitudes = np.zeros((1, 2))
    ends = 0.5 * dovetail.slot_length * np.linspace(-1.0, 1.0, 3)
    flanks = [squeezed(face) for face in space.interfaces]
    along = extruded_notch_models(section, flanks, amplitudes, ends)
    flat = notch_models(section, [squeezed(face) for face in plane.interfaces], amplitudes)
    for (long,), (short,) in zip(along, flat, strict=True):
        np.testing.assert_allclose(long.largest, short.largest, rtol=1e-6, atol=1e-6)
        assert np.abs(long.place)[[0, 2]] == pytest.approx(np.abs(short.place)[[0, 2]])
        assert long.cut_error == pytest.approx(short.cut_error, abs=1e-6)
        assert long.size_error == pytest.approx(short.size_error, abs=1e-6)
