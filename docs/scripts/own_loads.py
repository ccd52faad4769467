"""A source of loads of your own: a cylinder that slides back and forth under a constant force."""

import fretscale
import numpy as np

from sa_solver import LoadHistory, Material
from wear import ArchardLaw, CycleLoads


class Reciprocation(fretscale.UncoupledSource):
    """A cylinder of 10 mm pressed by 50 N/mm, which slides by 40 um in each of two increments."""

    peak, line = 0, True
    faces = (fretscale.ContactFace.nominal("pad", (1.4, 1.0), lambda x, y: x**2 / 20.0, line=True),)

    def unworn(self):
        zero, slip = np.zeros(2), np.zeros((2, 2, 2))  # increments; increments, x and y, nodes
        slip[0, 0], slip[1, 0] = 0.04, -0.04
        return (CycleLoads(LoadHistory(zero + 50.0, *[zero] * 7, sliding=zero == 0.0), slip),)


steel, law = Material(young=210e3, poisson=0.3), ArchardLaw(coefficient=1e-4, hardness=3000.0)
contact = fretscale.Contact((160, 1), (steel, steel), (law, law), friction=0.5)
model = fretscale.WearModel(Reciprocation(), contact, fretscale.Wear(cycles=2000.0))

if __name__ == "__main__":
    print(model.run()["pad"]["volume_1"])
