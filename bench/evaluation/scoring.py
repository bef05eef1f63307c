"""Scores of runs and of anybody's boxes, by named presets."""

from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

import datasets
from bench.evaluation.record import Run, Trace
from bench.evaluation.reference import reference
from bench.metrics import preset as metrics_preset
from bench.metrics.native import Truth
from bench.metrics.preset import Answer, Judged
from bench.metrics.regions import segmentation_scores
from bench.metrics.times import time_scores

__all__ = ["REVISED", "judge", "score", "score_both", "score_boxes"]

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
    if run.states is not None and one.protocol != "supervised":
        raise ValueError(f"{preset}: {run!r} was begun again after failures; it judges others.")
    answer = Answer(run.boxes_in(trace), run.visible, run.confidence, run.states)
    return one.judge(start, answer)


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
