"""Accuracy, robustness and expected average overlap of trackers begun again after failures.

The measures of VOT 2013 to 2019. A tracker whose region has no overlap with the truth has failed,
and is initialised anew 5 frames later. Accuracy is the mean overlap without the frames of failure,
those skipped, and 10 from every initialisation on; failures are counted; robustness is
exp(-30 failures / frames). A sequence has the mean of its repetitions, all sequences the means
weighted by their lengths. The expected average overlap is the mean, over lengths of 100 to 356
frames (as in VOT2018), of the mean overlap of that many frames after an initialisation: zero after
a failure, and without the pieces that end sooner with the sequence. Overlap is that of rasterised
regions, cut off at the image; `exact` columns take areas as they are. Kristan et al., "A novel
performance evaluation methodology for single-target trackers", TPAMI 2016.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import Truth
from trackmark.bench.metrics.preset import (
    Answer,
    Axes,
    Column,
    Judged,
    Preset,
    Runs,
    State,
    alone,
    started,
)
from trackmark.bench.metrics.region_overlap import exact_overlap, raster_overlap

_BURN_IN = 10
_SENSITIVITY = 30.0
_SHORTEST, _LONGEST = 100, 356
_KINDS = {"": raster_overlap, "_exact": exact_overlap}


def judge(truth: Truth, answer: Answer) -> Judged:
    """Return the scores of a run, and its curve for a data set of this run alone.

    Raises `ValueError` for a run without restart after a failure.
    """
    run = started(truth, answer)
    of_kind = {
        kind: overlap_of(run.truth, run.estimate, run.size, run.shapes)
        for kind, overlap_of in _KINDS.items()
    }
    states = _states(of_kind[""], None if answer.states is None else answer.states[run.frames])
    evidence = {"states": states}
    for kind, overlaps in of_kind.items():
        evidence[f"overlaps{kind}"] = np.where(states == State.TRACKED, overlaps, 0.0)
    return alone(combine, evidence)


def combine(runs: Runs) -> Judged:
    """Return the scores of all runs, sequences weighted by their lengths."""
    lengths = np.array([len(of[0].evidence["states"]) for of in runs], float)

    def weighted(values: list[float]) -> float:
        return float(np.average(values, weights=lengths))

    failures = weighted(
        [_mean((run.evidence["states"] == State.FAILED).sum() for run in of) for of in runs]
    )
    rate = failures / lengths.mean()
    scores = {"failures": failures, "robustness": float(np.exp(-_SENSITIVITY * rate))}
    curves = {}
    for kind in _KINDS:
        scores[f"accuracy{kind}"] = weighted(
            [_mean(_accuracy(run, kind) for run in of) for of in runs]
        )
        curve = _expected([piece for of in runs for run in of for piece in _pieces(run, kind)])
        part = curve[_SHORTEST : _LONGEST + 1]
        scores[f"eao{kind}"] = float(part.mean()) if len(part) else np.nan
        scores["eao_lengths"] = float(len(part))
        curves[f"eao{kind}"] = np.column_stack([np.arange(len(curve)), curve])
    curves["accuracy_robustness"] = np.array([[scores["robustness"], scores["accuracy"]]])
    return Judged({name: scores[name] for name in PRESET.columns}, curves)


def _states(overlaps: NDArray[np.float64], given: NDArray[Any] | None) -> NDArray[np.int64]:
    """Return the states of a run's frames, also of a one-pass run without failure."""
    if given is None:
        if (overlaps <= 0.0).any():
            raise ValueError(
                "vot-supervised: the tracker failed, and was not begun again there; this preset "
                "judges runs by --protocol supervised."
            )
        given = np.full(len(overlaps), State.TRACKED)
        given[0] = State.INITIALISED
    states = np.asarray(given, np.int64)
    if states.shape != overlaps.shape or states[0] != State.INITIALISED:
        raise ValueError("a supervised run has a state a frame, the first one INITIALISED.")
    after_failure = np.isin(states[:-1], (State.FAILED, State.SKIPPED))
    follows = np.isin(states[1:], (State.SKIPPED, State.INITIALISED))
    wrong = (follows != after_failure) | ~np.isin(states[1:], list(State))
    if wrong.any():
        frame = int(wrong.argmax()) + 1
        raise ValueError(
            f"a supervised run can't have the state {states[frame]} after {states[frame - 1]}, as "
            f"it has {frame} frames from its first: after a failure, and only then, a tracker is "
            "not asked or begun again."
        )
    return states


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


def _accuracy(run: Judged, kind: str) -> float:
    """Return the mean overlap of the frames that count; 0 if none does."""
    states = run.evidence["states"]
    counted = states == State.TRACKED
    for start in np.flatnonzero(states == State.INITIALISED):
        counted[start : start + _BURN_IN] = False
    return float(run.evidence[f"overlaps{kind}"][counted].mean()) if counted.any() else 0.0


def _pieces(run: Judged, kind: str) -> Iterable[tuple[NDArray[np.float64], bool]]:
    """Yield overlaps from every initialisation up to the failure, and whether there was one."""
    states, overlaps = run.evidence["states"], run.evidence[f"overlaps{kind}"]
    failures = np.flatnonzero(states == State.FAILED)
    for start in np.flatnonzero(states == State.INITIALISED):
        later = failures[failures > start]
        end = int(later[0]) if len(later) else len(states)
        yield overlaps[start:end], bool(len(later))


def _expected(pieces: list[tuple[NDArray[np.float64], bool]]) -> NDArray[np.float64]:
    """Return the mean overlap of the first frames after an initialisation, by their number."""
    longest = max(len(overlaps) for overlaps, _ in pieces)
    total, count = np.zeros(longest), np.zeros(longest)
    numbers = np.maximum(np.arange(longest), 1)
    for overlaps, failed in pieces:
        until = longest if failed else len(overlaps)
        padded = np.zeros(longest)
        padded[1 : len(overlaps)] = overlaps[1:]
        total[:until] += (np.cumsum(padded) / numbers)[:until]
        count[:until] += 1
    return total / count


PRESET = Preset(
    columns={
        "accuracy": Column("mean overlap while tracking"),
        "failures": Column("failures a sequence", 0.0, "lower"),
        "robustness": Column("exp(-30 failures / frames)"),
        "eao": Column("expected average overlap over 100 to 356 frames", whole=True),
        "eao_lengths": Column("of these 257 lengths those that occur", None, None, whole=True),
        "accuracy_exact": Column("accuracy by exact areas"),
        "eao_exact": Column("expected average overlap by exact areas", whole=True),
    },
    judge=judge,
    combine=combine,
    curves={
        "eao": Axes("frames", "expected average overlap"),
        "eao_exact": Axes("frames", "expected average overlap"),
        "accuracy_robustness": Axes("robustness", "accuracy"),
    },
    protocol="supervised",
    agrees="vot-toolkit 0.7.1",
    also=("vot", "vot-accuracy-robustness", "vot-eao"),
)
