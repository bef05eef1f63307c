"""Scores of runs and of anybody's boxes, by named presets."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import reference
from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.metrics import canonical
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.native import Truth
from trackmark.bench.metrics.preset import Answer, Judged, Preset, Target
from trackmark.bench.metrics.regions import segmentation_scores
from trackmark.bench.metrics.times import time_scores
from trackmark.bench.protocols import ProtocolError, stored_protocol, title
from trackmark.bench.protocols import names as protocol_names
from trackmark.bench.protocols import protocol as protocol_of

REVISED = "revised_"
"""How the names of scores of revised boxes begin, where they stand beside those of online boxes."""


def judge(
    run: Run, sequence: str | Truth, preset: str = "native", trace: Trace = "online"
) -> Judged:
    """What a preset makes of a run, by the truth that it was initialised with: scores and curves.

    Parameters as of `score`, and so is what it raises.
    """
    if run.failure:
        raise ValueError(f"{run!r} can't be scored: {run.failure.splitlines()[0]}")
    if trace not in get_args(Trace):
        raise ValueError(f"unknown trace {trace!r}. Known: online, revised.")
    scored = _truth(sequence)
    fingerprint = getattr(scored, "fingerprint", run.identity.fingerprint)
    if fingerprint != run.identity.fingerprint:
        raise ValueError(
            f"{run!r} was made on another sequence, or on another version of it; run it again."
        )
    start = reference(scored, run.identity.init, run.identity.sequence)
    one = metrics_preset(preset)
    if not can_judge(preset, run.identity.protocol):
        raise ValueError(
            f"{canonical(preset)} judges no runs by the protocol {title(run.identity.protocol)}, "
            f"but those by {', '.join(_protocols_for(one))}."
        )
    if run.states is not None and one.protocol != "supervised":
        raise ValueError(f"{preset}: {run!r} was begun again after failures; it judges others.")
    boxes = run.boxes_in(trace)
    _check_segments(run, scored.boxes, start.boxes)
    if not run.segments:
        return one.judge(start, Answer(boxes, run.visible, run.confidence, run.states))
    parts = []
    for frames, rows in zip(run.segments, _rows_of(run.segments), strict=True):
        answer = Answer(boxes[rows], run.visible[rows], run.confidence[rows], of=len(start.boxes))
        parts.append(one.judge(_seen_in(frames, start), answer))
    return replace(one.combine([parts]), parts=parts)


def can_judge(preset: str, protocol: str) -> bool:
    """Whether a metrics preset is for runs that are filed under a protocol.

    None is for unknown ones: runs of a later trackmark may be by protocols that it has alone.
    """
    try:
        one = stored_protocol(protocol)
    except ProtocolError:
        return False
    return metrics_preset(preset).protocol in one.judged


def _protocols_for(one: Preset) -> list[str]:
    return [name for name in protocol_names() if one.protocol in protocol_of(name).judged]


def _check_segments(run: Run, boxes: NDArray[Any], given: NDArray[Any]) -> None:
    """Raise `ValueError` unless a run has the segments that its protocol makes of the truth.

    Anybody may have written a stored run: its frames are places in the truth. `boxes`, `given`: of
    the truth, and of the region of it that the run starts from. If segments begin by numbers that
    the data bring, which no stored truth has, each has to go from a frame to an end. The same holds
    for imported runs: other toolkits choose other starts.
    """
    n = len(boxes)
    for frames in run.segments:
        first = int(frames[0]) if len(frames) and frames.dtype.kind == "i" else -1
        ways = np.arange(first, n), np.arange(first, -1, -1)
        if not (0 <= first < n and any(np.array_equal(frames, way) for way in ways)):
            raise ValueError(f"{run!r} has a segment that is not from a frame to an end of {n}.")
    rules = stored_protocol(run.identity.protocol)
    if run.segments and (rules.by_values or run.identity.imported):
        return
    present = np.isfinite(boxes).all(axis=1) & np.isfinite(given).all(axis=1)
    asked = rules.segments(present, {}) if rules.segmented and present.any() else []
    expected = [one.frames(n) for one in asked]
    if len(expected) != len(run.segments) or not all(map(np.array_equal, run.segments, expected)):
        raise ValueError(
            f"{run!r} has {len(run.segments)} segments, which are not the {len(expected)} of the "
            f"protocol {title(run.identity.protocol)}."
        )


def _rows_of(segments: Sequence[NDArray[Any]]) -> list[slice]:
    """Which rows of a run its segments are."""
    ends = np.cumsum([len(frames) for frames in segments]).tolist()
    return [slice(end - len(frames), end) for frames, end in zip(segments, ends, strict=True)]


def _seen_in(frames: NDArray[Any], truth: Truth) -> Target:
    """The truth of a segment's frames, in its order."""
    shapes = getattr(truth, "shapes", None)
    step = -1 if frames[-1] == 0 else 1  # to an end of the sequence
    return Target(
        truth.boxes[frames],
        {name: boxes[frames] for name, boxes in truth.regions.items()},
        truth.visibility[frames],
        getattr(truth, "image_size", None),
        None if shapes is None else shapes[int(frames[0]) :: step],
    )


def score(
    run: Run, sequence: str | Truth, preset: str = "native", trace: Trace = "online"
) -> dict[str, float]:
    """Score a run, by the truth that it was initialised with.

    Parameters
    ----------
    run : Run
        A finished run.
    sequence : str or Sequence
        What it ran on.
    preset : str
        Whose definitions; see `bench.metrics`.
    trace : {'online', 'revised'}
        Score what the tracker said at once, or what it said in the end.

    Returns
    -------
    dict of str to float
        The preset's scores; those of masks (`bench.metrics.regions.segmentation_scores`) where the
        tracker gave any, whatever the preset, by what it said at once; for timing runs the times.

    Raises
    ------
    ValueError
        For a failed run, an unknown preset or trace, a sequence that it was not made on, or a run
        that the preset can't judge.
    """
    scores = dict(judge(run, sequence, preset, trace).scores)
    if run.segmentation is not None and trace == "online":
        initialised = int(np.flatnonzero(np.isfinite(run.boxes[:, 0]))[0])
        scores |= segmentation_scores(run.segmentation, initialised)
    return scores if run.times is None else {**scores, **time_scores(run.times)}


def score_both(run: Run, sequence: str | Truth) -> dict[str, float]:
    """Scores of a run by the preset `native`, and those of its revised boxes (`REVISED`).

    Parameters as of `score`. Of runs that revised nothing, and of timing runs, there are only those
    of the online boxes.
    """
    scores = score(run, sequence)
    if run.revised is None or run.times is not None:
        return scores
    revised = score(run, sequence, trace="revised")
    return scores | {REVISED + name: value for name, value in revised.items()}


def score_boxes(
    boxes: ArrayLike, sequence: str | Truth, preset: str = "native"
) -> dict[str, float]:
    """Score anybody's boxes.

    Parameters
    ----------
    boxes : array of float64, shape (n, 4)
        `[x, y, width, height]` in pixels from 0, one row a frame of the sequence.
    sequence : str or Sequence
        What they are boxes of.
    preset : str
        Whose definitions.

    Returns
    -------
    dict of str to float
        The preset's scores (`mean_overlap`, `success_frames`, `centre_error`, …).

    Examples
    --------
    >>> truth = datasets.load("samples/face")
    >>> score_boxes(truth.boxes, truth)["mean_overlap"]
    1.0
    """
    return dict(metrics_preset(preset).judge(_truth(sequence), Answer(boxes)).scores)


def _truth(sequence: str | Truth) -> Truth:
    return datasets.load(sequence) if isinstance(sequence, str) else sequence
