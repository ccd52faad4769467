"""The default dovetail (cases/dovetail.yaml), built and worn in Python."""

from math import pi, radians

import fretscale

from sa_solver import Material
from wear import EnergyLaw

titanium = Material(young=115e3, poisson=0.29, density=4.43e-9, yield_stress=900.0)
law = EnergyLaw(1e-8)  # 1e4 um^3/J in mm^3/(N mm)
joint = fretscale.DovetailJoint(
    geometry=fretscale.Dovetail(
        flank_angle=radians(45.0), flank_length=8.0, edge_radius=30.0, edge_width=1.5,
        end_radius=150.0, end_width=3.0, neck_width=20.0, neck_fillet=3.0, slot_length=60.0,
        slot_fillet=3.0, root_depth=6.0, shank_height=30.0, slot_clearance=1.0, lug_height=6.0,
        blades=24, rim_radius=250.0, disk_height=60.0,
    ),
    disk=titanium,
    blade=titanium,
    missions=(fretscale.Mission(22, 8, 6000.0 * pi / 30.0, 0.8e-3, 400.0, 30e3),),
)  # fmt: skip
contact = fretscale.Contact((96, 192), (titanium, titanium), (law, law), friction=0.4)
model = fretscale.WearModel(joint, contact, fretscale.Wear(cycles=3e5), fretscale.Stress())

if __name__ == "__main__":
    results = model.run([fretscale.Progress()])
    print(results["intrados"]["largest_depth_1"])
