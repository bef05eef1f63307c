"""One step of the tracker, with all that its cues found: what Fig. 5 and 6 show.

The frame was fixed before any run: the tenth after the first of the first scene, repetition 0.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

import datasets
from bench.experiments.contestant import contestant, run_seed
from datasets.interface import Image, Mask
from trackers.base.interface import Estimate
from trackers.contours.cues.chain import Chain, Hypotheses
from trackers.contours.fisher.cells import colour_cells
from trackers.contours.fisher.discriminant import basis_of
from trackers.contours.segmentation.observation import Observation
from trackers.moreno2005 import Moreno2005

__all__ = ["FRAME", "SEQUENCE", "STEPS", "Step", "step_of"]

SEQUENCE = "moreno2005/leaf:jump=middle"
STEPS = 10
FRAME = f"{SEQUENCE}, scene\N{NO-BREAK SPACE}0, frame\N{NO-BREAK SPACE}{STEPS}"
"""What is shown, for a title."""

Array: TypeAlias = NDArray[np.float64]


class KeepingChain(Chain[Observation]):
    """A chain that keeps what was found in the last frame.

    Attributes
    ----------
    found : tuple of Hypotheses
        By cue; none before the first frame.
    """

    found: tuple[Hypotheses, ...] = ()

    def step(
        self, observation: Observation, generator: np.random.Generator
    ) -> tuple[Hypotheses, ...]:
        """See `Chain.step`."""
        self.found = super().step(observation, generator)
        return self.found


class Step(NamedTuple):
    """What the tracker found in a frame.

    Attributes
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        The frame.
    mask : ndarray of bool, shape (height, width)
        What is seen of the target in it.
    planes, colours, contours : Hypotheses
        Of the three cues.
    bases : ndarray of float64, shape (n, 3, 2)
        Of the planes.
    of_target : int
        How many of a pair's components, the first ones, are the target's.
    estimate : Estimate
        With arrays.
    cells : ndarray of int32, shape (height, width)
        Cell of every pixel's colour: a column of the colours' evidence.
    """

    image: Image
    mask: Mask
    planes: Hypotheses
    colours: Hypotheses
    contours: Hypotheses
    bases: Array
    of_target: int
    estimate: Estimate
    cells: NDArray[np.int32]

    def posterior(self, number: int) -> Array:
        """Posterior map, shape (height, width), by a pair of mixtures."""
        values: Array = self.colours.evidence[number][self.cells].astype(np.float64)
        return values


def step_of(text: str) -> Step:
    """Run the tracker through the first frames, as experiments do.

    Parameters
    ----------
    text : str
        Text form of `moreno2005`.
    """
    sequence, chosen = datasets.load(SEQUENCE), contestant(text)
    tracker = chosen.make(run_seed(chosen.name, sequence.name, 0))
    assert isinstance(tracker, Moreno2005)
    first = sequence.first_frame
    tracker.init(sequence[first], sequence.boxes[first], sequence.mask(first))
    chain = KeepingChain(tracker.chain.cues, tracker.chain.association, tracker.chain.feedback)
    tracker.chain = chain
    for frame in range(first + 1, first + STEPS + 1):
        image, mask = sequence[frame], sequence.mask(frame)
        estimate = tracker.update(image)
    assert mask is not None
    planes, colours, contours = chain.found
    settings = tracker.parameters
    return Step(
        image=image,
        mask=mask,
        planes=planes,
        colours=colours,
        contours=contours,
        bases=basis_of(planes.states, tracker.planes.basis),
        of_target=settings.object_components,
        estimate=estimate,
        cells=colour_cells(image, settings.colour_levels).image,
    )
