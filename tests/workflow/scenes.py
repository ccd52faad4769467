"""Short case texts that several test modules run."""

BALL = """\
title: Ball
analysis: contact
structure: {kind: bodies, shape: sphere, radius: 10 mm}
materials:
  body_1: {young: 115 GPa, poisson: 0.29}
  body_2: {young: 115 GPa, poisson: 0.29}
friction: {coefficient: 0.7}
load_path:
  legs:
    - {P: 400 N}
    - {Qx: 210 N, increments: 4}
contact: {grid: [16, 16], size: [1 mm, 1 mm]}
"""

# The loads of a cylinder that slides back and forth are in a table in the same folder.
ROLLER_WEAR = """\
title: Cylinder that wears under loads of a table
analysis: wear
structure:
  kind: resultants
  file: loads.csv
  dimension: 2
  size: 1.6 mm
  gap: {shape: paraboloid, radius_x: 10 mm}
materials:
  body_1: {young: 115 GPa, poisson: 0.29}
  body_2: {young: 115 GPa, poisson: 0.29}
friction: {coefficient: 0.4}
contact: {grid: [32, 8]}
wear:
  law: energy
  body_1: {coefficient: 1e4 um^3/J}
  body_2: {coefficient: 1e4 um^3/J}
  cycles: 4e4
  step: {kind: implicit, cycles: 1e4}
stress: {section: none, life: {parameter: none}}
output: {paraview: false, figures: false}
"""
ROLLER_LOADS = """\
P [N/mm], Qx [N/mm], My [N], Edx [mJ/mm]
400, 150, 0, 0.3
400, -150, 0, 3
400, 150, 0, 3
"""

# The rig of two masses of `cases/rig_two_dof.yaml`, which several analyses shake.
RIG_OF_THESIS = """\
structure:
  kind: rig
  masses: [21.152 kg, 1.189 kg]
  springs: [1.3469e3 N/mm, 273e3 N/mm]
  damping_ratio: 0.01
"""
