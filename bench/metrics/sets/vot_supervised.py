"""Accuracy, robustness and expected average overlap of trackers restarted after failures.

These are the measures of VOT 2013 to 2019. A tracker fails if its region does not overlap the
ground truth, and is initialised again 5 frames later. Accuracy is the mean overlap without frames
of failures, skipped frames and the 10 frames from each initialisation on. Without other frames it
is 0, as in the toolkit. Robustness is exp(-30 failures / frames). Scores of a sequence are averaged
over repetitions, then over sequences weighted by length. The expected average overlap is the mean,
over lengths k of 100 to 356 frames (as in VOT2018), of the mean overlap of the first k frames after
an initialisation. The overlap is 0 after a failure. Initialisations after which the sequence ends
sooner are excluded. Overlaps are those of rasterised regions clipped to the image. Kristan et al.,
"A novel performance evaluation methodology for single-target trackers", TPAMI 2016.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.interface import (
    FrameState,
    GroundTruthLike,
    Metric,
    MetricResult,
    Metrics,
    ResultsBySequence,
    RunEstimates,
    select_evaluated,
    single_run_result,
)
from trackmark.bench.metrics.region_overlap import raster_overlap

_BURN_IN = 10
_SENSITIVITY = 30.0
_MIN_LENGTH, _MAX_LENGTH = 100, 356


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> MetricResult:
    """Return the scores of a run, and its curve for a data set of this run alone.

    Raises `ValueError` for a run that was not restarted after a failure.
    """
    run = select_evaluated(truth, estimates)
    overlaps = raster_overlap(run.truth, run.estimate, run.size, run.shapes)
    states = _check_states(
        overlaps, None if estimates.states is None else estimates.states[run.frames]
    )
    overlaps = np.where(states == FrameState.TRACKED, overlaps, 0.0)
    intermediate = {
        "states": states,  # of annotated frames, as the overlaps
        "overlaps": overlaps,
        "frames": run.frames - run.frames[0],
        "length": np.array(len(truth.boxes) - run.frames[0]),
    }
    return single_run_result(combine, intermediate)


def combine(runs: ResultsBySequence) -> MetricResult:
    """Return the scores of all runs, sequences weighted by their lengths."""
    lengths = np.array([int(group[0].intermediate["length"]) for group in runs], float)

    def weighted(values: list[float]) -> float:
        return float(np.average(values, weights=lengths))

    failures = weighted(
        [
            _mean((run.intermediate["states"] == FrameState.FAILED).sum() for run in group)
            for group in runs
        ]
    )
    rate = failures / lengths.mean()
    curve = _expected([fragment for group in runs for run in group for fragment in _fragments(run)])
    averaged = curve[_MIN_LENGTH : _MAX_LENGTH + 1]
    averaged = averaged[np.isfinite(averaged)]
    scores = {
        "accuracy": weighted([_mean(_accuracy(run) for run in group) for group in runs]),
        "failures": failures,
        "robustness": float(np.exp(-_SENSITIVITY * rate)),
        "eao": float(averaged.mean()) if len(averaged) else np.nan,
        "eao_lengths": float(len(averaged)),
    }
    curves = {
        "eao": np.column_stack([np.arange(len(curve)), curve]),
        "accuracy_robustness": np.array([[scores["robustness"], scores["accuracy"]]]),
    }
    return MetricResult(scores, curves)


def _check_states(overlaps: NDArray[np.float64], states: NDArray[Any] | None) -> NDArray[np.int64]:
    """Return the states of the frames of a supervised run, or of a one-pass run without failure."""
    if states is None:
        if (overlaps <= 0.0).any():
            raise ValueError(
                "vot-supervised: the tracker failed and was not restarted. Expected: runs with "
                "--protocol supervised."
            )
        states = np.full(len(overlaps), FrameState.TRACKED)
        states[0] = FrameState.INITIALISED
    states = np.asarray(states, np.int64)
    if states.shape != overlaps.shape or states[0] != FrameState.INITIALISED:
        raise ValueError(
            f"The states of a supervised run have shape {states.shape}. Expected: "
            f"{overlaps.shape}, with INITIALISED first."
        )
    after_failure = np.isin(states[:-1], (FrameState.FAILED, FrameState.SKIPPED))
    follows = np.isin(states[1:], (FrameState.SKIPPED, FrameState.INITIALISED))
    wrong = (follows != after_failure) | ~np.isin(states[1:], list(FrameState))
    if wrong.any():
        frame = int(wrong.argmax()) + 1
        raise ValueError(
            f"Supervised run, frame {frame} after the first initialisation: state {states[frame]} "
            f"after {states[frame - 1]}. Expected: SKIPPED or INITIALISED after FAILED or SKIPPED, "
            "else FAILED or TRACKED."
        )
    return states


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


def _accuracy(run: MetricResult) -> float:
    """Return the mean overlap of the frames that count for the accuracy; 0 if there are none."""
    states = run.intermediate["states"]
    counted = states == FrameState.TRACKED
    frames = run.intermediate["frames"]
    for start in frames[states == FrameState.INITIALISED]:
        counted &= (frames < start) | (frames >= start + _BURN_IN)
    return float(run.intermediate["overlaps"][counted].mean()) if counted.any() else 0.0


class _Fragment(NamedTuple):
    """Frames from an initialisation to a failure or to the end of the sequence."""

    sums: NDArray[np.float64]  # (n,): sum of the overlaps in the first k frames
    n_annotated: NDArray[np.int64]  # (n,): number of annotated frames among these
    failed: bool


def _fragments(run: MetricResult) -> Iterable[_Fragment]:
    """Yield the pieces of a run, one per initialisation; the init frame itself does not count."""
    states, overlaps, frames = (run.intermediate[key] for key in ("states", "overlaps", "frames"))
    failures = np.flatnonzero(states == FrameState.FAILED)
    for start in np.flatnonzero(states == FrameState.INITIALISED):
        later = failures[failures > start]
        end = int(later[0]) if len(later) else len(states)
        stop = int(frames[end] if len(later) else run.intermediate["length"]) - int(frames[start])
        by_frame, is_annotated = np.zeros(stop), np.zeros(stop, np.int64)
        positions = frames[start + 1 : end] - frames[start]
        by_frame[positions], is_annotated[positions] = overlaps[start + 1 : end], 1
        yield _Fragment(np.cumsum(by_frame), np.cumsum(is_annotated), bool(len(later)))


def _expected(fragments: list[_Fragment]) -> NDArray[np.float64]:
    """Return the mean overlap of the first k frames after an initialisation, by k.

    It is NaN if none of these frames is annotated.
    """
    longest = max(len(fragment.sums) for fragment in fragments)
    total, count = np.zeros(longest), np.zeros(longest)
    for fragment in fragments:
        n = len(fragment.sums)
        until = longest if fragment.failed else n
        # Frames after a failure count with overlap 0.
        sums = np.pad(fragment.sums, (0, longest - n), mode="edge")
        n_annotated = np.concatenate(
            [fragment.n_annotated, fragment.n_annotated[-1] + 1 + np.arange(longest - n)]
        )
        is_defined = n_annotated > 0
        is_defined[0] = True  # the init frame, with overlap 0
        total[:until] += (sums / np.maximum(n_annotated, 1))[:until]
        count[:until] += is_defined[:until]
    return np.asarray(np.divide(total, count, out=np.full(longest, np.nan), where=count > 0))


METRICS = Metrics(
    metrics={
        "accuracy": Metric("mean overlap while tracking"),
        "failures": Metric("failures per sequence", 0.0, "lower"),
        "robustness": Metric("exp(-30 failures / frames)"),
        "eao": Metric("expected average overlap over 100 to 356 frames", only_overall=True),
        "eao_lengths": Metric(
            "number of the 257 lengths for which there are runs", None, None, only_overall=True
        ),
    },
    score=score_run,
    combine=combine,
    curves={
        "eao": ("frames", "expected average overlap"),
        "accuracy_robustness": ("robustness", "accuracy"),
    },
    run_kind="supervised",
    agrees_with="vot-toolkit 0.7.1",
    aliases=("vot", "vot-accuracy-robustness", "vot-eao"),
)
