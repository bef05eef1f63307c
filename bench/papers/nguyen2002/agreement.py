"""How far the compiled tracker is from the same method in plain NumPy, online and looking ahead."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
import trackers
from bench.evaluation.loop import run_in_lock_step
from bench.evaluation.record import Run
from bench.experiments.contestant import contestant
from bench.metrics.scoring import score
from bench.papers.nguyen2002.courses import course_of
from bench.papers.nguyen2002.events import declared_in
from bench.papers.nguyen2002.plain import PlainNguyen2002, track_offline
from datasets import Sequence, SequenceError
from trackers.base.interface import Box, Image

__all__ = ["differences", "outlasted"]

FEATURES = ("intensity", "rgb", "invariants", "arctan")
PRESETS = ("as-written", "recommended", "robust")
CLIP = "nguyen2002/clip-01"
QUICK = slice(44, 95)
"""Frames about its occlusion, after which there is time to find the end."""

LONG = "nguyen2002/clip-04"
"""More than a quarter of the target is hidden in 27 frames in a row."""

SHORT, AS_LONG = 19, 35
"""L, in frames: of these the occlusion outlasts the first."""

Boxes = NDArray[np.float64]


def differences(*, quick: bool) -> pd.DataFrame:
    """Greatest differences between implementations on a clip, and whether events are the same.

    Parameters
    ----------
    quick : bool
        By RGB alone, and on a part of it.

    Returns
    -------
    DataFrame
        A row a preset and features (`preset`, `features`); greatest differences of boxes [pixels]:
        `online`, `revised` (of compiled and plain), `offline` (of revised boxes, and a plain run
        that looks ahead as the paper does), `sooner` (of boxes said at once, and those of runs
        that end before an occlusion's end is known); `same_events` (1 or 0: when occlusions are
        declared, and where those end that do).
    """
    sequence = datasets.load(CLIP)
    if quick:
        sequence = sequence[QUICK]
    chosen = ("rgb",) if quick else FEATURES
    ways = [(preset, features) for preset in PRESETS for features in chosen]
    runs = _runs([f"nguyen2002:preset={way[0]}:features={way[1]}" for way in ways], sequence)
    images, box = list(sequence), sequence.boxes[0]
    return pd.DataFrame(
        {"preset": preset, "features": features} | _compared(run, images, box)
        for (preset, features), run in zip(ways, runs, strict=True)
    )


def _compared(run: Run, images: list[Image], box: Box) -> dict[str, float]:
    parameters = run.identity.parameters
    online, revised, hidden = _plain(images, box, parameters)
    offline, events = track_offline(images, box, **parameters)
    ours = [event[:2] for event in declared_in(run) if event.end is not None]
    theirs = [event for event in events if event[1] < len(images)]
    same = ours == theirs and np.array_equal(run.details["occluded"][1:], hidden[1:])
    return {
        "online": _apart(run.boxes, online),
        "revised": _apart(run.boxes_in("revised"), revised),
        "offline": _apart(run.boxes_in("revised"), offline),
        "sooner": _sooner(run, images, box),
        "same_events": float(same),
    }


def _sooner(run: Run, images: list[Image], box: Box) -> float:
    """How far boxes said at once are from those of runs that end where nothing is known yet."""
    ends = np.flatnonzero(run.details["revision"] > 0).tolist() or [len(images) // 2]
    apart = []
    for end in ends:
        tracker = trackers.create("nguyen2002", **run.identity.parameters)
        tracker.init(images[0], box)
        said = [tracker.update(image).box for image in images[1:end]]
        apart.append(_apart(run.boxes[1:end], np.array(said)))
    return max(apart)


def outlasted() -> pd.DataFrame:
    """Whether an occlusion that lasts longer than the tracker looks ahead costs it the target.

    Returns
    -------
    DataFrame
        `longest_occlusion` (shorter than the occlusion, and as written), `success` (1 or 0, of the
        revised boxes); by RGB.
    """
    sequence = datasets.load(LONG)
    lengths = (SHORT, AS_LONG)
    text = "nguyen2002:preset=as-written:features=rgb:longest_occlusion="
    rows = []
    runs = _runs([f"{text}{longest}" for longest in lengths], sequence)
    for longest, run in zip(lengths, runs, strict=True):
        loss = score(run, sequence, trace="revised")["first_loss"]
        success = course_of(run, sequence, "revised", loss)["success"]
        rows.append({"longest_occlusion": longest, "success": success})
    return pd.DataFrame(rows)


def _runs(texts: list[str], sequence: Sequence) -> list[Run]:
    runs = run_in_lock_step([(contestant(text), 0) for text in texts], sequence).runs
    for text, run in zip(texts, runs, strict=True):
        if run.failure:
            reason = run.failure.partition("\n")[0]
            raise SequenceError(f"{sequence.name}: {text} failed: {reason}")
    return runs


def _plain(
    images: list[Image], box: Box, parameters: Mapping[str, Any]
) -> tuple[Boxes, Boxes, NDArray[np.bool_]]:
    """Online and revised boxes, and the frames in which the target was taken to be hidden."""
    tracker = PlainNguyen2002(**parameters)
    tracker.init(images[0], box)
    online, hidden = np.tile(box, (len(images), 1)), np.zeros(len(images), np.bool_)
    known: dict[int, Box] = {}
    for frame, image in enumerate(images[1:], 1):
        online[frame], hidden[frame], revised = tracker.update(image)
        known |= revised
    known |= tracker.finish()
    in_the_end = online.copy()
    for frame, corrected in known.items():
        in_the_end[frame] = corrected
    return online, in_the_end, hidden


def _apart(ours: Boxes, theirs: Boxes) -> float:
    return float(np.abs(ours - theirs).max())
