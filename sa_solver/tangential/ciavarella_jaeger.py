"""First loading of a line contact by a shear force: the difference of two normal problems.

Between similar half-planes, shear displaces the surfaces tangentially by as much as pressure of the
same distribution displaces them normally. If p(P) is the pressure under P, then

    q = µ [p(P) - p(P*)],   P* = P - |Q|/µ, at the tilt of p(P)

sticks where p(P*) > 0 and slips elsewhere, with the rigid shift µ (δz - δz*). This holds on a grid
as in the continuum, so that q also solves the discrete problem.

Sources: Ciavarella 1998, Int. J. Solids Struct. 35, 2349; Jäger 1997, J. Tribol. 119, 401.
"""

from __future__ import annotations

import numpy as np

from sa_solver.normal.contact import NormalContact
from sa_solver.normal.state import NormalState
from sa_solver.tangential.contact import TangentialResiduals, TangentialState
from sa_solver.types import Array


def first_loading(
    contact: NormalContact,
    height: Array,
    normal: NormalState,
    friction: float,
    Qx: float,
    tolerance: float,
) -> TangentialState:
    """Return shear and slip of a line contact that is sheared for the first time.

    Parameters
    ----------
    contact
        Solver of the normal problem.
    height
        Gap before loading ``(nx, 1)`` [mm].
    normal
        State under the normal load P.
    friction
        Coefficient of friction µ.
    Qx
        Shear force [N/mm], smaller than µP.
    tolerance
        Bound on the residuals of the second normal problem.
    """
    stuck = contact.solve(
        height,
        normal.P - abs(Qx) / friction,
        tilt_y=normal.tilt_y,
        tolerance=tolerance,
        start=normal.start,
    )
    factor = friction * np.sign(Qx)
    shear = np.stack([factor * (normal.pressure - stuck.pressure), np.zeros(height.shape)])
    displacement = np.stack(
        [factor * (normal.displacement - stuck.displacement), np.zeros(height.shape)]
    )
    shift = factor * (normal.approach - stuck.approach)
    # In contact under P the gap is 0, so that the slip is µ times the gap under P*.
    slip = np.where(
        normal.pressure > 0.0, displacement - np.array([shift, 0.0])[:, None, None], 0.0
    )
    slip[0, stuck.pressure[:, 0] > 0.0] = 0.0
    carried = float(shear[0].sum()) * contact.grid.cell_area
    return TangentialState(
        shear=shear,
        slip=slip,
        displacement=displacement,
        sticking=stuck.pressure > 0.0,
        shift_x=float(shift),
        shift_y=0.0,
        twist=0.0,
        Qx=carried,
        Qy=0.0,
        Mz=0.0,
        residuals=TangentialResiduals(
            abs(carried - Qx) / (friction * normal.P), 0.0, stuck.residuals.largest
        ),
        converged=stuck.converged,
        message="" if stuck.converged else stuck.message,
        convolutions=stuck.convolutions,
        cell_area=stuck.cell_area,
    )
