"""What short runs of the trackers show; of the tables, see `scenes`."""

from collections.abc import Iterator, Mapping
from math import nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.readings import ANY
from bench.experiments.contestant import contestant, run_seed
from bench.metrics.centre_error import centre_error, centre_inside, centres
from bench.papers.scenes import Tables, short_runs
from bench.papers.wang2010.plain_maps import box_slices
from datasets import Sequence
from datasets.text_form import parse_text
from trackers.base.interface import Box, Image, Tracker

__all__ = [
    "MOVING_CAMERA",
    "particle_drift",
    "particle_weights",
    "seen_by_cameras",
    "starts_beside",
]

Array = NDArray[np.float64]

PRESETS = ("as-written", "recommended")
FILTERS = ("wang2010", "particle-filter")
QUICK_FRAMES = 20

MOVING_CAMERA = ("multipart/1", "nummiaro2003/traffic")
"""Sequences of other suites in which the camera follows the target."""


def particle_drift(sequence: Sequence, quick: bool) -> Tables:
    """`wa-11` (`wang2010`), a frame and stage a row: whether drift takes particles to the target.

    `preset`, `frame`, `inside` (1: the estimate's centre is inside the true box), `stage`
    (`predicted`: before the drift; `drifted`), and what `drifted` tells.
    """
    part = sequence[:QUICK_FRAMES] if quick else sequence
    middles = centres(sequence.boxes)
    rows: list[dict[str, str | float]] = []
    found = short_runs(part, [f"wang2010:preset={preset}" for preset in PRESETS])
    for preset, run in zip(PRESETS, found, strict=True):
        for frame in range(1, len(part)):
            inside = float(centre_inside(part.boxes[frame], run.boxes[frame])[0])
            labels: dict[str, str | float] = {"preset": preset, "frame": frame, "inside": inside}
            rows += [labels | row for row in drifted(run.arrays[frame], middles[frame])]
    return {"wa-11": pd.DataFrame(rows)}


def drifted(arrays: Mapping[str, Array], target: Array) -> list[dict[str, str | float]]:
    """Particles before and after the drift, from an estimate's arrays and the true centre [pixels].

    `distance` (mean, of the particles to the true centre [pixels]), `spread` (root mean square
    distance from their mean [pixels]), `similarity` (mean M/M0), `risen`, `fallen` (share of the
    particles whose M/M0 rises or falls by the drift; of `drifted` alone).
    """
    before, after = arrays["predicted_similarity"], arrays["similarity"]
    shares = {"risen": float(np.mean(after > before)), "fallen": float(np.mean(after < before))}
    nothing = dict.fromkeys(shares, nan)
    return [
        {"stage": "predicted"} | _cloud(arrays["predicted"], before, target) | nothing,
        {"stage": "drifted"} | _cloud(arrays["particles"], after, target) | shares,
    ]


def _cloud(places: Array, similarity: Array, target: Array) -> dict[str, float]:
    offsets = places - places.mean(axis=0)
    return {
        "distance": float(np.hypot(*(places - target).T).mean()),
        "spread": float(np.sqrt((offsets**2).sum(axis=1).mean())),
        "similarity": float(similarity.mean()),
    }


def particle_weights(sequence: Sequence, quick: bool) -> Tables:
    """`wa-29`, a frame a row: whether the observation tells particles on the target from others.

    `tracker` (`wang2010`, `particle-filter`), `preset`, `frame`, `effective_share` (ESS/N),
    `weight_ratio` (greatest weight times N), and what `on_against_off` tells.
    """
    part = sequence[:QUICK_FRAMES] if quick else sequence
    labels = [{"tracker": tracker, "preset": preset} for tracker in FILTERS for preset in PRESETS]
    found = short_runs(part, [f"{one['tracker']}:preset={one['preset']}" for one in labels])
    rows = [
        {
            **label,
            "frame": frame,
            "effective_share": float(run.details["effective_sample_size"][frame]),
            "weight_ratio": float(run.details["weight_ratio"][frame]),
        }
        | on_against_off(
            run.arrays[frame]["particles"], run.arrays[frame]["weights"], part.boxes[frame]
        )
        for label, run in zip(labels, found, strict=True)
        for frame in range(1, len(part))
    ]
    return {"wa-29": pd.DataFrame(rows)}


def on_against_off(particles: Array, weights: Array, box: Box) -> dict[str, float]:
    """How many particles are on the target, and how their weight compares with the others'.

    `on_target` (share of the particles, shape (n, 2) [pixels], inside the true box), `on_over_off`
    (mean weight of these over that of the others; NaN where there are none of either).
    """
    on = ((particles >= box[:2]) & (particles < box[:2] + box[2:])).all(axis=1)
    both = on.any() and not on.all()
    ratio = float(weights[on].mean() / weights[~on].mean()) if both else nan
    return {"on_target": float(on.mean()), "on_over_off": ratio}


def seen_by_cameras(sequence: Sequence, quick: bool) -> Tables:
    """`camera`, a frame a row: what the motion map says where the camera moves, and at rest.

    `camera` (`moving`, `at rest`), `frame`, and of the tracker's details `changing`, `moving`,
    `moving_inside`. Where it moves edges change all over the image, some tenths of the pixels, and
    with them the adaptive threshold rises.
    """
    first = sequence.first_frame
    part = sequence[first : first + (12 if quick else 50)]
    (run,) = short_runs(part, ["wang2010:preset=as-written"])
    moves = parse_text(sequence.name)[0] in MOVING_CAMERA
    details = ("changing", "moving", "moving_inside")
    rows = pd.DataFrame({detail: run.details[detail][1:] for detail in details})
    rows.insert(0, "camera", "moving" if moves else "at rest")
    rows.insert(1, "frame", range(first + 1, first + len(part)))
    return {"camera": rows}


WIDTHS = (0, 1, 2, 3)  # of the target's box
IN_TIME = 20  # frames
REPETITIONS = 5
STARTERS = (
    *(
        (name, preset, f"{name}:preset={preset}", REPETITIONS)
        for name in FILTERS
        for preset in PRESETS
    ),
    ("camshift fixed", ANY, "camshift:window=fixed", 1),
    ("camshift adaptive", ANY, "camshift:window=adaptive", 1),
)
"""Label, preset, text form, and how often it starts: CamShift draws no random numbers."""


def starts_beside(sequence: Sequence, quick: bool) -> Tables:
    """`wa-28`, a start and repetition a row: whether trackers that start beside a target find it.

    A tracker learns the target from a first image in which a copy of it stands beside it, and is
    shown the sequence from then on: its template is right, and its place is wrong. The copy
    vanishes with the first image; what moves there has the ground's colours.

    `tracker` (`wang2010`, `particle-filter`, `camshift fixed`, `camshift adaptive`), `preset`
    (`any` of CamShift), `start` (frame), `widths` (of the box, by which it starts beside the
    target; 0 to compare with), `right`, `down` (likewise [pixels]), `repetition`, and what
    `outcome` tells of the twenty frames after; the tolerance is half the mean side of the boxes.
    """
    tolerance = float(sequence.boxes[:, 2:].mean()) / 2
    last = len(sequence) - 1 - IN_TIME
    starts = np.linspace(0, max(last, 0), 1 if quick else 3).round().astype(int)
    rows = []
    for start in np.unique(starts).tolist():
        part = sequence[start : start + IN_TIME + 1]
        image, box = part[0], part.boxes[0]
        for number, (widths, offset) in enumerate(ways(box, image.shape)):
            view, beside = displaced(image, box, offset)
            for tracker, preset, text, most in STARTERS:
                chosen = contestant(text)
                for repetition in range(1 if quick else most):
                    seed = run_seed(chosen.name, sequence.name, REPETITIONS * number + repetition)
                    made = chosen.make(seed)
                    made.init(view, beside)
                    errors = centre_error(part.boxes[1:], _followed(made, part))
                    labels = {"tracker": tracker, "preset": preset, "start": start}
                    place = {"widths": widths, "right": offset[0], "down": offset[1]}
                    told = outcome(errors, tolerance)
                    rows.append({**labels, **place, "repetition": repetition, **told})
    return {"wa-28": pd.DataFrame(rows)}


def ways(box: Box, shape: tuple[int, ...]) -> Iterator[tuple[int, tuple[int, int]]]:
    """Widths by which a box is moved, and how far right and down, as far as it stays in the image.

    Offsets are whole pixels.
    """
    rows, columns = shape[:2]
    x, y, width, height = box.tolist()
    for widths in WIDTHS:
        far = round(widths * width)
        for right, down in dict.fromkeys([(far, 0), (-far, 0), (0, far), (0, -far)]):
            left, top = x + right, y + down
            inside = left >= 0 and top >= 0 and left + width <= columns and top + height <= rows
            if inside or not widths:
                yield widths, (right, down)


def displaced(image: Image, box: Box, offset: tuple[int, int]) -> tuple[Image, Box]:
    """An image with a copy of the box's pixels beside it, and the box around the copy."""
    right, down = offset
    rows, columns = box_slices(image.shape, box)
    patch = image[rows, columns]
    view = image.copy()
    place = view[rows.start + down : rows.stop + down, columns.start + right : columns.stop + right]
    place[:] = patch[: place.shape[0], : place.shape[1]]
    return view, box + [right, down, 0, 0]


def outcome(errors: Array, tolerance: float) -> dict[str, float]:
    """What became of a start, from the errors in the frames after it [pixels].

    `recovered` (in the last frame the error is within the tolerance), `recovered_from` (frame after
    the start from which it stays so), `reached` (it is within that in any frame).
    """
    outside = np.flatnonzero(errors > tolerance)
    since = int(outside[-1]) + 2 if len(outside) else 1
    recovered = since <= len(errors)
    return {
        "recovered": float(recovered),
        "recovered_from": float(since) if recovered else nan,
        "reached": float(len(outside) < len(errors)),
    }


def _followed(tracker: Tracker, part: Sequence) -> Array:
    """Its boxes in all frames but the first."""
    return np.array([tracker.update(part[frame]).box for frame in range(1, len(part))])
