"""Two specimens of a friction rig that fret and wear each other in cycle blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fe_models.joints.reduced_contact import FrettingConditions
from fe_models.solvers.blas_threads import one_thread
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array, unseen
from wear.coupled_state import Observer, check_observers
from wear.laws import WearLaw
from wear.steps.marching import rest
from wear.steps.steppers import ExplicitStepper
from workflow.errors import MethodFailed, TooCoarse, UserError
from workflow.layout.declared import declared
from workflow.models.contact import check_two_laws
from workflow.models.specimens.reduced import ReducedSpecimens, SpecimenPair
from workflow.models.specimens.wear import BlockState, FrettedPair, wear_in_cycle_blocks
from workflow.models.structure_model import StructureStore

if TYPE_CHECKING:
    import xarray as xr

# Limit on cycle blocks, each of which takes milliseconds: more are most likely an error in the
# model.
MOST_BLOCKS = 20_000
COORDINATES = declared("""
    cycles | 1 | cycles | cycles at the start of each block
    x, y | mm | node | place of the node on the pad
""")
FIELDS = declared("""
    depth_1, depth_2 | mm | cycles node | worn depth of body #
    pressure | MPa | cycles node | normal pressure
    slip | mm | cycles node | path that the node slides in a cycle
""")
SCALARS = declared("""
    volume_1, volume_2 | mm^3 | cycles | worn volume of body #
    energy | N mm | cycles | energy dissipated so far
    energy_per_cycle | N mm | cycles | energy dissipated in a cycle
    stick_stiffness | N/mm | cycles | stiffness along x, with all nodes in contact stuck
    area | mm^2 | cycles | area in contact
    friction | 1 | cycles | largest tangential force over the normal force
""")


@dataclass(frozen=True)
class FrettedSpecimens:
    """A pair of specimens that wears, node by node, under a constant normal force and a stroke.

    Pressure and slip are those of the reduced models: pressure first, then shear, and the loop from
    first loading by Masing's rule.

    Parameters
    ----------
    specimens : SpecimenPair
        The two specimens.
    conditions : FrettingConditions
        Normal force, stroke and friction (:class:`fe_models.FrettingConditions`).
    laws : (WearLaw, WearLaw)
        Wear laws of body 1 and body 2.
    cycles : float, optional
        Length of the run in cycles; give either this or ``energy``.
    energy : float, optional
        Energy at which the run ends, with a whole block [N mm].
    fraction : float
        Length of a block over its stability limit.
    block : float, optional
        Cycles of every block, instead of ``fraction``.

    Examples
    --------
    Coarse specimens under 60 N lose the volume α E that their energy wears:

    >>> import fretscale
    >>> from fe_models import FrettingConditions
    >>> from fe_models.geometry import Specimen
    >>> from sa_solver import Material
    >>> from wear import EnergyLaw
    >>> steel, law = Material(200e3, 0.3, density=7.8e-9), EnergyLaw(1.5e-9)
    >>> pair = fretscale.SpecimenPair(Specimen(pad_elements=4), (steel, steel), size=4.0, order=1)
    >>> conditions = FrettingConditions(force=60.0, stroke=0.014, friction=0.88)
    >>> worn = fretscale.FrettedSpecimens(pair, conditions, (law, law), cycles=1e4).run()
    >>> energy, volume = (float(worn[name][-1]) for name in ("energy", "volume_1"))
    >>> print(f"{volume / energy:.2e} {worn['energy'].attrs['units']}")
    1.50e-09 N mm
    """

    specimens: SpecimenPair
    conditions: FrettingConditions
    laws: tuple[WearLaw, WearLaw]
    cycles: float | None = None
    energy: float | None = None
    fraction: float = 0.5
    block: float | None = None

    def __post_init__(self) -> None:
        checks.instances(self, specimens=SpecimenPair, conditions=FrettingConditions)
        check_two_laws(self.laws)
        checks.numbers(self, "cycles", "energy", "block", above=0.0)
        checks.numbers(self, "fraction", above=0.0, most=1.0)
        if self.specimens.target_distance is not None:
            raise InputError("target_distance is for specimens of a rig: leave it out to wear them")
        if (self.cycles is None) == (self.energy is None):
            raise InputError("specimens wear over a number of cycles or to an energy: give one")

    def run(
        self, observers: Sequence[Observer] = (), store: StructureStore | None = None
    ) -> xr.Dataset:
        """Compute the wear and return the results at the start of every cycle block.

        Parameters
        ----------
        observers : sequence of Observer
            Called while the run goes on, such as :class:`fretscale.Progress`.
        store : StructureStore, optional
            Storage of reduced models between runs.

        Returns
        -------
        xarray.Dataset
            Depths, pressure and slip at the nodes of the pad, and numbers of the pair, with units
            and descriptions as attributes.

        Raises
        ------
        MeshError
            The specimens cannot be meshed.
        MethodFailed
            A contact did not converge.
        StabilityError
            A block of the given length is unstable.
        UserError
            The run would not come to an end.
        """
        check_observers(observers)
        pair = self.specimens
        reduced = pair.reduced if store is None else ReducedSpecimens(pair, store)
        reduced.prepare(unseen)
        with one_thread():
            return _results(reduced, list(self.blocks(reduced, observers=observers)))

    def blocks(
        self,
        reduced: ReducedSpecimens,
        steps: Steps = COMPUTED,
        observers: Sequence[Observer] = (),
    ) -> Iterator[BlockState]:
        """Yield the state of the ``reduced`` specimens at the start of each block, and the last."""
        fretted = FrettedPair(reduced.pair, self.laws, self.conditions, steps)
        stepper = (
            ExplicitStepper(self.fraction)
            if self.block is None
            else ExplicitStepper(cycles=self.block)
        )
        return wear_in_cycle_blocks(
            fretted, reduced.face.gap, stepper, self._checked_to_go, observers
        )

    def _checked_to_go(self, state: BlockState) -> float:
        self._check(state)
        return self._to_go(state)

    def _to_go(self, state: BlockState) -> float:
        """Return the largest number of cycles of the block after ``state``; 0 at the end.

        A run up to an energy ends with the first whole block that reaches it. Where nothing wears
        yet, the block ends as soon as the energy is reached at the present rate.
        """
        if self.cycles is not None:
            return rest(self.cycles, state.cycles)
        assert self.energy is not None
        left = (self.energy - state.energy) / state.contact.energy
        block = self._block(state)
        return 0.0 if left <= 0.0 else max(left, block if np.isfinite(block) else 0.0)

    def _block(self, state: BlockState) -> float:
        """Return the number of cycles of a whole block after ``state``."""
        return self.fraction * state.stable_cycles if self.block is None else self.block

    def _check(self, state: BlockState) -> None:
        """Raise an error unless the state has converged and the run comes to an end."""
        contact, force = state.contact, f"{self.conditions.force:g} N"
        if not contact.converged:
            raise MethodFailed(
                f"contact at {force} did not converge after {state.cycles:.4g} cycles; change "
                "pad_elements or lower the fraction of a block"
            )
        if self.energy is not None and contact.energy == 0.0:
            raise UserError(
                f"energy: nothing slides at {force}, so this energy is never dissipated: raise the "
                "stroke or the friction, or give cycles"
            )
        if state.wear.any() and np.isinf(state.stable_cycles):
            raise TooCoarse(
                f"pad_elements: only one node of the pad touches at {force}, too few to wear: "
                "raise it, or the normal force"
            )
        # Number of blocks of the run if all are as long as the first one.
        needed = state.number or self._to_go(state) / self._block(state)
        if needed > MOST_BLOCKS:
            raise UserError(
                f"more than {MOST_BLOCKS} cycle blocks at {force}: lower the wear coefficients, "
                "the cycles or the energy, or lengthen the blocks"
            )


def _results(reduced: ReducedSpecimens, blocks: Sequence[BlockState]) -> xr.Dataset:
    """Return the states as labelled arrays."""
    import xarray as xr

    areas, (x, y) = reduced.pair.areas, reduced.face.coordinates.T

    def of_all(value: Callable[[BlockState], Array | float]) -> Array:
        return np.array([value(block) for block in blocks])

    depths = of_all(lambda block: block.depths)
    volumes = of_all(lambda block: block.depths @ areas)
    fields = {
        "depth_1": depths[:, 0],
        "depth_2": depths[:, 1],
        "pressure": of_all(lambda block: block.contact.normal.pressure),
        "slip": of_all(lambda block: block.contact.cycle_slip),
    }
    scalars = {
        "volume_1": volumes[:, 0],
        "volume_2": volumes[:, 1],
        "energy": of_all(lambda block: block.energy),
        "energy_per_cycle": of_all(lambda block: block.contact.energy),
        "stick_stiffness": of_all(lambda block: block.contact.stick_stiffness),
        "area": of_all(lambda block: block.contact.normal.area),
        "friction": of_all(lambda block: block.contact.friction),
    }
    places = {"cycles": of_all(lambda block: block.cycles), "x": x, "y": y}
    return xr.Dataset(
        {name: FIELDS[name].variable(array) for name, array in fields.items()}
        | {name: SCALARS[name].variable(array) for name, array in scalars.items()},
        coords={name: COORDINATES[name].variable(array) for name, array in places.items()},
    )
