"""List of the materials that a case may name, for ``fretscale materials``."""

from __future__ import annotations

from collections.abc import Iterator

from workflow.case.materials import MATERIALS
from workflow.case.text.plain import aligned

HEAD = "name", "young", "poisson", "density", "yield", "state"


def known_materials() -> Iterator[str]:
    """Yield the lines of a table with units, then the sources of the values."""
    yield "materials: {body_1: Ti-6Al-4V, body_2: {material: Ti-6Al-4V, yield_stress: 830 MPa}}"
    yield ""
    rows = [HEAD]
    for name, known in MATERIALS.items():
        yields = "-" if known.yield_stress is None else f"{known.yield_stress:g} MPa"
        elastic = f"{known.young:g} GPa", f"{known.poisson:g}", f"{known.density:g} kg/m^3"
        rows.append((name, *elastic, yields, known.state))
    yield from aligned(rows)
    yield ""
    for name, known in MATERIALS.items():
        yield f"{name} ({', '.join(known.also)}): {known.source}"
