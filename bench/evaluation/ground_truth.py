"""Ground truth that a run starts from and is scored by: the boxes of a sequence, or a region."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.experiments.tracker_spec import BOXES
from trackmark.bench.metrics.native import GroundTruthLike
from trackmark.datasets import SequenceError
from trackmark.datasets.spec_string import close_match


@dataclass(frozen=True)
class RegionGroundTruth:
    """Ground truth with one of its regions in place of its boxes."""

    boxes: NDArray[np.float64]
    regions: Mapping[str, NDArray[np.float64]]
    visibility: NDArray[np.float64]
    origin: GroundTruthLike

    @property
    def image_size(self) -> tuple[int, int] | None:
        """Width and height of the images; None if unknown."""
        size: tuple[int, int] | None = getattr(self.origin, "image_size", None)
        return size


def select_ground_truth(
    truth: GroundTruthLike, region: str, name: str = "the sequence"
) -> GroundTruthLike:
    """Return the ground truth of a run that is initialised with a region.

    `truth`: a sequence, or its stored ground truth. `region`: `boxes`, or one of `truth.regions`.
    `name`: the sequence's name, for messages.

    Raises `SequenceError` for an unknown region, or one that is absent when the boxes begin.
    """
    if region == BOXES:
        return truth
    if region not in truth.regions:
        valid_names = [BOXES, *sorted(truth.regions)]
        hint = close_match(region, valid_names)
        raise SequenceError(
            f"{name} has no region {region!r} to initialise with (init={region}).{hint} "
            f"Known: {', '.join(valid_names)}."
        )
    boxes = truth.regions[region]
    present = np.flatnonzero(np.isfinite(truth.boxes).all(axis=1))
    if len(present) and not np.isfinite(boxes[present[0]]).all():
        raise SequenceError(
            f"{name}: the region {region!r} is absent in frame {present[0]}, where the target "
            "appears; no tracker can be initialised with it."
        )
    return RegionGroundTruth(boxes, truth.regions, truth.visibility, truth)
