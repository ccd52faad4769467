"""Declarations of the stress of bodies and under contacts."""

from __future__ import annotations

MOMENTS = "unworn", "worn"
"""When stress is computed: before any wear, and at the end of a run."""

_BULK = "with what the structure carries past it where the group says bulk_stress"
BODY = """
    points | mm | vertex axis | vertices, the faces of body 2 in their form
    elements | 1 | element corner | corner vertices of tetrahedra, or of triangles in the plane
    displacement | mm | vertex axis | displacement at peak load
    stress | MPa | stress_component vertex | xx, yy, zz, xy, yz, zx of the global axes at peak load
    von_mises | MPa | vertex | von Mises stress at peak load
    maximum_principal | MPa | vertex | largest principal stress at peak load
"""
SECTION_AXES = """
    along | mm | along | centres of the section's cells, along its axis
    depths | mm | depths | depth of the section's points below the surface
"""
SECTION = f"""
    stress | MPa | stress_component along depths | xx, yy, zz, xy, yz, zx in the section at peak
        load, {_BULK}
    von_mises | MPa | along depths | von Mises stress at peak load
"""
LIFE = f"""
    friction_parameter | N/mm | x y | Ruiz's F1: a quarter of the friction work of a cycle per area
    tension | MPa | x y | largest tension along the surface over a cycle,
        {_BULK}
    cracking_parameter | N^2/mm^3 | x y | Ruiz's F2: F1 times tension
    smith_watson_topper | MPa | x y | largest normal stress times strain amplitude, worst plane
    strain_amplitude | 1 | x y | amplitude of the normal strain on the worst plane
    findley | MPa | x y | shear stress amplitude plus k largest normal stress, worst plane
    shear_amplitude | MPa | x y | amplitude of the shear stress on the worst plane
    normal_stress | MPa | x y | largest normal stress over a cycle on the worst plane,
        {_BULK}
    normal | 1 | axis x y | unit normal of the worst plane, in the interface frame
"""
