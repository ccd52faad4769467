"""Handwritten Abaqus input files in the style of CAE."""

from fe_models.geometry.imported import read_bodies

# Two cubes side by side along x, their nodes numbered from 11, and a tetrahedron.
PARTS = """\
*Heading
 two parts, three instances
** written by hand, as CAE does: µ
*Preprint, echo=NO, model=NO
*Part, name=Block
*Node
     11,           0.,           0.,           0.
     12,           1.,           0.,           0.
     13,           2.,           0.,           0.
     14,           0.,           1.,           0.
     15,           1.,           1.,           0.
     16,           2.,           1.,           0.
     21,           0.,           0.,           1.
     22,           1.,           0.,           1.
     23,       2.0D+00,          0.,           1.
     24,           0.,           1.,           1.
     25,           1.,           1.,           1.
     26,           2.,           1.,           1.
*Element, type=C3D8R
 7, 11, 12, 15, 14, 21, 22, 25, 24
 8, 12, 13, 16, 15, 22, 23, 26, 25
*Nset, nset=Corner
 11,
*Elset, elset=_Top_S2, internal, generate
 7, 8, 1
*Surface, type=ELEMENT, name=Top
_Top_S2, S2
*Elset, elset="Left one"
 7
*Surface, name=End
 8, S4
*Solid Section, elset=_Top_S2, material=Steel
,
*End Part
*Part, name=Pin
*Node, nset=AllOfPin
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 0., 1., 0.
 4, 0., 0., 1.
 99, 5., 5., 5.
*Element, type=C3D4, elset=Body
 1, 1, 2, 3, 4
*End Part
"""
ASSEMBLY = """\
*Assembly, name=Assembly
*Instance, name=Block-1, part=BLOCK
*End Instance
*Instance, name=Block-2, part=Block
 3., 0., 5.
 3., 0., 5., 3., 1., 5., 90.
*End Instance
*Instance, name=Pin-1, part=Pin
 0., 0., 1.
*End Instance
*Node
 1, 0., 0., 9.
*Nset, nset=Reference
 1,
*Elset, elset=_Feet_S1, internal, instance=Block-1
 7, 8
*Elset, elset=_Feet_S1, internal, instance=Pin-1
 1
*Surface, type=ELEMENT, name=Feet
_Feet_S1, S1
*Surface, type=ELEMENT, name=Left
"Block-1.Left one", S6
*Nset, nset=Ends, instance=Block-1, generate
 13, 23, 5
*Nset, nset=Ends
 Pin-1.4, Block-2.CORNER
*End Assembly
*Material, name=Steel
*Elastic
 200000., 0.3
*Step, name=Load
*Static
*End Step
"""
CUBES = PARTS[PARTS.index("*Node") : PARTS.index("*Nset")]


def read(tmp_path, text, name="model.inp"):
    path = tmp_path / name
    path.write_text(text, encoding="latin-1")
    return read_bodies(path)
