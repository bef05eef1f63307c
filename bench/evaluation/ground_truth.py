"""Ground truth that initialises and scores a run, and the segments that it gives.

The ground truth is the boxes or a region of a sequence.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.experiments.tracker_spec import BOXES
from trackmark.bench.metrics.interface import GroundTruthArrays, GroundTruthLike
from trackmark.bench.protocols import EvaluationProtocol, Segment, protocol_of_key
from trackmark.datasets import Sequence, SequenceError
from trackmark.datasets.spec_string import name_hint


def select_ground_truth(
    truth: GroundTruthLike, region: str, name: str = "the sequence"
) -> GroundTruthLike:
    """Return the ground truth of a run that is initialised with `region`.

    `truth` is a sequence or its stored ground truth. `region` is `boxes` or one of `truth.regions`.
    `name` is the sequence's name, for messages.

    Raises `SequenceError` if the region is unknown, or absent in the first frame with a target.
    """
    if region == BOXES:
        return truth
    if region not in truth.regions:
        hint = name_hint(region, [BOXES, *sorted(truth.regions)])
        raise SequenceError(f"{name} has no region {region!r} (init={region}).{hint}")
    boxes = truth.regions[region]
    present = np.flatnonzero(np.isfinite(truth.boxes).all(axis=1))
    if len(present) and not np.isfinite(boxes[present[0]]).all():
        raise SequenceError(
            f"{name}: the region {region!r} is absent in frame {present[0]}, the first one with "
            "the target. Use another region for init."
        )
    return GroundTruthArrays(
        boxes,
        annotated=truth.annotated,
        malformed=truth.malformed,
        regions=truth.regions,
        visibility=truth.visibility,
        image_size=getattr(truth, "image_size", None),
    )


def segment_frames(protocol: str, sequence: Sequence, init: str) -> tuple[NDArray[np.int32], ...]:
    """Return the frame numbers of each segment; empty for a protocol without segments.

    `protocol` is the stored name. `init` names the ground truth for the initialisation.

    Raises `SequenceError` if the sequence does not have this region, or no ground truth.
    """
    rules = protocol_of_key(protocol)
    return frames_of_segments(rules, find_segments(rules, sequence, init), len(sequence))


def frames_of_segments(
    protocol: EvaluationProtocol, segments: Iterable[Segment], n_frames: int
) -> tuple[NDArray[np.int32], ...]:
    """Return the frame numbers of each segment of a sequence; see `segment_frames`."""
    if not protocol.has_segments:
        return ()
    return tuple(np.array(segment.frames(n_frames), np.int32) for segment in segments)


def find_segments(
    protocol: EvaluationProtocol, sequence: Sequence, init: str
) -> tuple[Segment, ...]:
    """Return the segments of a run; the errors are those of `segment_frames`."""
    boxes = select_ground_truth(sequence, init, sequence.name).boxes
    present = sequence.present & np.isfinite(boxes).all(axis=1)
    return tuple(protocol.segments(present, sequence.frame_values))
