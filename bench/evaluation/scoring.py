"""Scores of runs and of boxes, by metrics presets."""

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.evaluation.sequence_cache import load_sequence
from trackmark.bench.metrics import canonical_name
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.native import GroundTruthLike
from trackmark.bench.metrics.preset import (
    GroundTruthArrays,
    PresetResult,
    RunEstimates,
    annotates_init_only,
)
from trackmark.bench.metrics.regions import segmentation_scores
from trackmark.bench.protocols import ProtocolError, parse_protocol, stored_protocol, title
from trackmark.bench.protocols import names as protocol_names

DEFAULT_PRESET = "native"
"""Preset whose scores are stored with every run; undefined scores are NaN."""

REVISED = "revised_"
"""Prefix of the names of scores of revised boxes."""


def score_run(
    run: Run,
    sequence: str | Path | GroundTruthLike,
    preset: str = "native",
    trace: Trace = "online",
) -> PresetResult:
    """Return the scores and curves of a run by a preset.

    Parameters and errors are those of `score`.
    """
    if run.failure:
        raise ValueError(f"{run!r} cannot be scored: {run.failure.splitlines()[0]}")
    if trace not in get_args(Trace):
        raise ValueError(f"unknown trace {trace!r}. Known: online, revised.")
    scored = _truth(sequence)
    fingerprint = getattr(scored, "fingerprint", run.identity.fingerprint)
    if fingerprint != run.identity.fingerprint:
        raise ValueError(
            f"{run!r} was made on another sequence, or on another version of this sequence. Run "
            "the tracker again."
        )
    init = select_ground_truth(scored, run.identity.init, run.identity.sequence)
    if n := int(run.circumstances.get("unscored_frames", 0)):
        init = _without_last(init, n)
    chosen = metrics_preset(preset)
    if not can_score(preset, run.identity.protocol):
        names = [
            name for name in protocol_names() if chosen.protocol in parse_protocol(name).judged
        ]
        raise ValueError(
            f"{canonical_name(preset)} cannot score runs of the protocol "
            f"{title(run.identity.protocol)}. It scores runs of {', '.join(names)}."
        )
    if run.states is not None and chosen.protocol != "supervised":
        raise ValueError(f"{preset} cannot score {run!r}: it has restarts. Use vot-supervised.")
    _check_annotation(preset, init, run.identity.sequence)
    boxes = run.boxes_in(trace)
    if not run.segments:
        return chosen.score(init, RunEstimates(boxes, run.visible, run.confidence, run.states))
    parts, stop = [], 0
    for frames in run.segments:
        rows = slice(stop, stop := stop + len(frames))
        answer = RunEstimates(
            boxes[rows], run.visible[rows], run.confidence[rows], n_sequence_frames=len(init.boxes)
        )
        parts.append(chosen.score(_select_frames(init, frames), answer))
    return replace(chosen.combine([parts]), parts=parts)


def can_score(preset: str, protocol: str) -> bool:
    """Return whether a metrics preset can score runs of a stored protocol.

    No preset can score unknown protocols, which a later version of trackmark may have stored.
    """
    try:
        rules = stored_protocol(protocol)
    except ProtocolError:
        return False
    return metrics_preset(preset).protocol in rules.judged


def _check_annotation(preset: str, truth: GroundTruthLike, name: str) -> None:
    """Raise `ValueError` if a preset would score the init box only; `native` scores are NaN."""
    if canonical_name(preset) != DEFAULT_PRESET and annotates_init_only(truth):
        raise ValueError(
            f"{canonical_name(preset)} cannot score runs on {name}: no frame after the "
            "initialisation is annotated, as in test sets. Export the results for the evaluation "
            "server of the data set."
        )


def _select_frames(truth: GroundTruthLike, frames: NDArray[Any]) -> GroundTruthArrays:
    """Return the ground truth of a segment, in the order of its frames."""
    shapes = getattr(truth, "shapes", None)
    step = -1 if frames[-1] == 0 else 1  # to an end of the sequence
    return GroundTruthArrays(
        truth.boxes[frames],
        {name: boxes[frames] for name, boxes in truth.regions.items()},
        truth.visibility[frames],
        getattr(truth, "image_size", None),
        None if shapes is None else shapes[int(frames[0]) :: step],
        annotated=np.broadcast_to(truth.annotated, len(truth.boxes))[frames],
        malformed=np.broadcast_to(truth.malformed, len(truth.boxes))[frames],
    )


def _without_last(truth: GroundTruthLike, n: int) -> GroundTruthArrays:
    """Return the ground truth with the last n frames not annotated, and thus not scored.

    Toolkits score imported results of fewer rows in this way.
    """
    frames = np.arange(len(truth.boxes))
    selected = _select_frames(truth, frames)
    return replace(selected, annotated=selected.annotated & (frames < len(frames) - n))


def score(
    run_or_boxes: Run | ArrayLike,
    sequence: str | Path | GroundTruthLike | None = None,
    metrics: str = "native",
    trace: Trace = "online",
    *,
    preset: str | None = None,
) -> dict[str, float]:
    """Score a run by the ground truth that it was initialised with, or score boxes of any origin.

    Parameters
    ----------
    run_or_boxes : Run or array of float64, shape (n, 4)
        A finished run, or boxes `[x, y, width, height]` in pixels from 0, one row per frame.
    sequence : str, Path or Sequence, optional
        The sequence of the boxes; see `load_sequence`. That of a run is opened by default.
    metrics : str
        Definitions of the scores: one of `trackmark.metrics.names()`.
    trace : {'online', 'revised'}
        Boxes of a run to score: as returned by each update, or with the tracker's corrections.
    preset : str, optional
        Former name of `metrics`, which will be removed.

    Returns
    -------
    dict of str to float
        Scores of the preset. For online boxes of runs with masks, also
        `bench.metrics.regions.segmentation_scores`.

    Raises
    ------
    TypeError
        For an object that is neither a run nor boxes, and for boxes without a sequence.
    ValueError
        For a failed run, an unknown preset or trace, another sequence, or a run that the preset
        cannot score.

    Examples
    --------
    >>> truth = load_sequence("samples/face")
    >>> score(truth.boxes, truth)["mean_overlap"]
    1.0
    """
    if preset is not None:
        message = "score: the argument preset is now called metrics. Use metrics=..."
        warnings.warn(message, FutureWarning, stacklevel=2)
        metrics = preset
    if not isinstance(run_or_boxes, Run):
        if sequence is None:
            raise TypeError("the sequence of the boxes is missing. Give its name or a Sequence.")
        try:
            boxes = np.asarray(run_or_boxes, dtype=np.float64)
        except (TypeError, ValueError):
            raise TypeError(
                f"{type(run_or_boxes).__name__} is neither a run nor boxes. Expected: a run, for "
                "example results['static', 'face'], or an array of shape (n, 4)."
            ) from None
        truth = _truth(sequence)
        _check_annotation(metrics, truth, getattr(truth, "name", "the sequence"))
        return dict(metrics_preset(metrics).score(truth, RunEstimates(boxes)).scores)
    run = run_or_boxes
    sequence = run.open_sequence() if sequence is None else sequence
    scores = dict(score_run(run, sequence, metrics, trace).scores)
    if run.segmentation is not None and trace == "online":
        initialised = int(np.flatnonzero(np.isfinite(run.boxes[:, 0]))[0])
        scores |= segmentation_scores(run.segmentation, initialised)
    return scores


def score_both(run: Run, sequence: str | GroundTruthLike) -> dict[str, float]:
    """Return the `native` scores of the online boxes and, if any, of the revised boxes.

    Names of scores of revised boxes start with `REVISED`. Parameters and errors are those of
    `score`.
    """
    scores = score(run, sequence)
    if run.revised is None or run.times is not None:
        return scores
    revised = score(run, sequence, trace="revised")
    return scores | {REVISED + name: value for name, value in revised.items()}


def _truth(sequence: str | Path | GroundTruthLike) -> GroundTruthLike:
    return load_sequence(sequence) if isinstance(sequence, str | Path) else sequence
