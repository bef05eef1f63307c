"""What no run of a tracker shows, measured on the scenes: what the maps mark of the target.

A table is named by its claim. Every one has `name` (the sequence, canonical), `sequence` (without
variant), `scene`, then columns of its own. Frames count from 0: the paper's frame k is k - 1. A
share or a yes or no is a float in [0, 1]; NaN where what is asked did not arise. Maps are those of
`plain_maps`, with the parameters of `as-written` unless these are columns.

"What moves" is the target, what holds it and whoever comes with it, by their true silhouettes.
`recall` is the share of it that a map B marks, `precision` the share of B that is on it, `f1` their
harmonic mean, in one frame; `precision_swept` the share of B where something moving is in any of
the images that B was made of (all else is noise, shadow or the rim of the window).
"""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.metrics.centre_error import centres
from bench.papers.scenes import SceneCheck, Tables, with_contrast, with_gain, with_noise
from bench.papers.wang2010.plain_maps import (
    Template,
    box_slices,
    colour_bins,
    colour_map,
    local_difference,
    make_template,
    moving,
    threshold,
)
from bench.papers.wang2010.short_runs import (
    MOVING_CAMERA,
    particle_drift,
    particle_weights,
    seen_by_cameras,
    starts_beside,
)
from bench.papers.wang2010.silhouettes import (
    MovingThings,
    found,
    found_and_swept,
    target_mask,
)
from datasets import Sequence
from trackers.base.interface import Box, Image, Mask

__all__ = ["CHECKS"]

Array = NDArray[np.float64]
Images = tuple[Image, Image, Image]

ALPHA, BINS = 0.7, 32  # weight of the hue, and bins of each histogram, as written
WINDOW = 5  # pixels a side, of the windows of differences as written

SIMILAR = ("on the face", "similar background")
"""Attributes of frames in which something beside the target has its hue."""

FIGURE = (10, 11)
"""Frames 11 and 12 of the paper, which its Fig. 1 shows."""


def colour_contrast(sequence: Sequence, quick: bool) -> Tables:
    """`wa-2`, a frame with any of the target and map a row: whether saturation sets it off.

    `map` (`hue`: I_h; `hue and saturation`: I_c), `frame`, `similar` (1: on the face, or before a
    background of similar colour), `inside` (mean over the target's pixels), `outside` (over all
    others within a width and a height of its box), `difference` (inside - outside), `contrast`
    (difference / (inside + outside), in [-1, 1]).
    """
    template = make_template(sequence[0], sequence.boxes[0])
    similar = np.zeros(len(sequence), np.bool_)
    for attribute in SIMILAR:
        similar |= sequence.attributes.get(attribute, False)
    rows = []
    for frame in range(1, len(sequence), max(1, len(sequence) // 10) if quick else 1):
        image, mask = sequence[frame], target_mask(sequence, frame)
        around = surroundings(sequence.boxes[frame], mask)
        if not mask.any() or not around.any():
            continue
        for name, alpha in (("hue", 1.0), ("hue and saturation", ALPHA)):
            colour = colour_map(image, template, alpha)
            inside, outside = float(colour[mask].mean()), float(colour[around].mean())
            both = inside + outside
            rows.append(
                {
                    "map": name,
                    "frame": frame,
                    "similar": float(similar[frame]),
                    "inside": inside,
                    "outside": outside,
                    "difference": inside - outside,
                    "contrast": (inside - outside) / both if both else 0.0,
                }
            )
    return {"wa-2": pd.DataFrame(rows)}


def surroundings(box: Box, mask: Mask) -> Mask:
    """Pixels within a width and a height of the target's box that do not show it."""
    x, y, width, height = box.tolist()
    rows, columns = np.indices(mask.shape) + 0.5
    beside = (columns >= x - width) & (columns < x + 2 * width)
    level = (rows >= y - height) & (rows < y + 2 * height)
    return np.asarray(beside & level & ~mask)


def change_by_light(sequence: Sequence, quick: bool) -> Tables:
    """`wa-3`, a frame, gain and map a row: how much maps of colour change with the light.

    `map` (`without value`: I_c; `with value`: value shares saturation's weight), `gain` (of the
    image), `frame`, `inside` (mean over the target's pixels), `change` (mean absolute change of
    these by the gain, over their mean without).
    """
    first, box = sequence[0], sequence.boxes[0]
    template = make_template(first, box)
    counts = np.bincount(_value_bins(first[box_slices(first.shape, box)]).ravel(), minlength=BINS)
    values = np.asarray(counts / counts.max())
    rows = []
    for frame in range(0, len(sequence), -(-len(sequence) // (2 if quick else 10))):
        image, mask = sequence[frame], target_mask(sequence, frame)
        if not mask.any():
            continue
        plain = _maps_of_colour(image, template, values)
        for gain in (0.5, 0.75, 1.25, 1.5):
            for name, changed in _maps_of_colour(with_gain(image, gain), template, values).items():
                inside, before = changed[mask], plain[name][mask]
                total = float(before.sum())
                change = float(np.abs(inside - before).sum()) / total if total else np.nan
                labels = {"map": name, "gain": gain, "frame": frame}
                rows.append({**labels, "inside": float(inside.mean()), "change": change})
    return {"wa-3": pd.DataFrame(rows)}


def _maps_of_colour(image: Image, template: Template, values: Array) -> dict[str, Array]:
    hue, saturation = colour_bins(image, BINS, BINS)
    main, second = ALPHA * template.hue[hue], template.saturation[saturation]
    third = values[_value_bins(image)]
    return {
        "without value": main + (1 - ALPHA) * second,
        "with value": main + (1 - ALPHA) * (second + third) / 2,
    }


def _value_bins(image: Image) -> NDArray[np.int64]:
    return np.asarray(image.max(axis=2).astype(np.int64) * BINS // 256)


def found_by_window(sequence: Sequence, quick: bool) -> Tables:
    """`wa-4`, a frame in which something moves and window a row.

    `window` (n), `frame`, `recall`, `precision`, `f1`, `precision_swept`.
    """
    things = MovingThings(sequence)
    rows = []
    for frame in things.frames(5 if quick else 25):
        images = latest(sequence, frame)
        swept = things.swept(range(frame - 2, frame + 1))
        for window in (1, 3, 5, 7):
            marked = moving(averaged(images, window))
            labels = {"window": window, "frame": frame}
            rows.append(labels | found_and_swept(marked, things[frame], swept))
    return {"wa-4": pd.DataFrame(rows)}


def found_by_differences(sequence: Sequence, quick: bool) -> Tables:
    """`wa-5`, a frame, step, noise and number of differences a row.

    `differences` (`one`: D1; `two`: (D1 + D2) / 2), `noise` (deviation of what is added [grey
    levels]), `frame`, `step` (frames from one image to the next), `speed` (of the target [pixels an
    image]), `slow` (1: from the frame before it moves less than from one frame to the next in half
    of them), `recall`, `precision`, `f1`, `precision_swept`.
    """
    generator = np.random.default_rng(0)
    things = MovingThings(sequence)
    speeds = np.hypot(*np.diff(centres(sequence.boxes), axis=0).T)  # to the next frame
    usual = float(np.nanmedian(speeds))
    rows = []
    for frame in things.frames(2 if quick else 12):
        speed = float(speeds[frame - 1])
        for step in (1, 2, 3):
            seen = frame, frame - step, frame - 2 * step
            if seen[-1] < 0:
                continue
            labels: dict[str, Any] = {"step": step, "speed": step * speed}
            labels["slow"] = float(speed < usual)
            swept = things.swept(seen)
            for noise in (0.0, 4.0, 8.0, 16.0):
                image, previous, earlier = (
                    with_noise(sequence[number], noise, generator) for number in seen
                )
                maps = {
                    "one": moving(local_difference(image, previous)),
                    "two": moving(averaged((image, previous, earlier))),
                }
                rows += [
                    {"differences": differences, "noise": noise, "frame": frame, **labels}
                    | found_and_swept(marked, things[frame], swept)
                    for differences, marked in maps.items()
                ]
    return {"wa-5": pd.DataFrame(rows)}


FACTORS = (2.0, 3.0, 4.0, 5.0, 6.0)  # λ
LEVELS = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0)
"""Fixed thresholds: mean absolute difference of a pixel of the window [grey levels]."""


def found_by_threshold(sequence: Sequence, quick: bool) -> Tables:
    """`wa-6`, a threshold, contrast and noise a row, means over frames.

    `rule` (`adaptive`, `fixed`), `level` (λ; or T as mean absolute difference of a pixel [grey
    levels]), `contrast` (1: as it is), `noise` (deviation [grey levels]), `recall`, `precision`,
    `f1`, `best` (1: of all levels of the rule, this one's mean F1 over all contrasts and noises of
    the scene is greatest).
    """
    generator = np.random.default_rng(0)
    things = MovingThings(sequence)
    rows: list[dict[str, Any]] = []
    for frame in things.frames(1 if quick else 6):
        for contrast in (1.0, 0.5, 0.25):
            views = [with_contrast(image, contrast) for image in latest(sequence, frame)]
            for noise in (0.0, 4.0, 8.0):
                image, previous, earlier = (with_noise(view, noise, generator) for view in views)
                difference = averaged((image, previous, earlier), WINDOW)
                grey_levels = difference / (3 * WINDOW**2)
                marked = {
                    ("adaptive", factor): difference > threshold(difference, factor)
                    for factor in FACTORS
                } | {("fixed", level): grey_levels > level for level in LEVELS}
                rows += [
                    {"rule": rule, "level": level, "contrast": contrast, "noise": noise}
                    | found(pixels, things[frame])
                    for (rule, level), pixels in marked.items()
                ]
    if not rows:
        return {"wa-6": pd.DataFrame()}
    keys = ["rule", "level", "contrast", "noise"]
    means = pd.DataFrame(rows).groupby(keys, as_index=False).mean()
    best = means.groupby(["rule", "level"])["f1"].mean().groupby("rule").idxmax().tolist()
    is_best = [float(key in best) for key in zip(means["rule"], means["level"], strict=True)]
    return {"wa-6": means.assign(best=is_best)}


def on_the_target(sequence: Sequence, quick: bool) -> Tables:
    """`wa-7` (Fig. 1), a frame and map a row: how much of what maps mark lies on the target.

    `map` (`colour`: I_c; `moving`: B; `colour and moving`: I_m), `frame`, `figure` (1: frame 11 or
    12 of the paper), `inside` (share of the map's sum that is on the target's pixels), `covered`
    (share of the target's pixels where the map is not 0).
    """
    template = make_template(sequence[0], sequence.boxes[0])
    every = -(-len(sequence) // (5 if quick else 25))
    rows = []
    frames = {*FIGURE, *range(2, len(sequence), every)}.intersection(range(len(sequence)))
    for frame in sorted(frames):
        images = latest(sequence, frame)
        mask = target_mask(sequence, frame)
        if not mask.any():
            continue
        colour = colour_map(images[0], template)
        marked = moving(averaged(images)).astype(np.float64)
        maps = {"colour": colour, "moving": marked, "colour and moving": marked * colour}
        for name, values in maps.items():
            total = float(values.sum())
            rows.append(
                {
                    "map": name,
                    "frame": frame,
                    "figure": float(frame in FIGURE),
                    "inside": float(values[mask].sum()) / total if total else np.nan,
                    "covered": float(np.count_nonzero(values[mask])) / np.count_nonzero(mask),
                }
            )
    return {"wa-7": pd.DataFrame(rows)}


def latest(sequence: Sequence, frame: int) -> Images:
    """A frame and the two before it."""
    return sequence[frame], sequence[frame - 1], sequence[frame - 2]


def averaged(images: Images, window: int = WINDOW) -> Array:
    """Mean of the last two local differences, (D1 + D2) / 2, shape (height, width)."""
    image, previous, earlier = images
    last = local_difference(image, previous, window)
    before = local_difference(previous, earlier, window)
    return np.asarray((last + before) / 2, np.float64)


OURS = ("wang2010/table-tennis", "wang2010/hand", "wang2010/cup")
CHECKS = (
    *(
        SceneCheck(measure, OURS)
        for measure in (colour_contrast, on_the_target, particle_drift, particle_weights)
    ),
    SceneCheck(seen_by_cameras, OURS + MOVING_CAMERA),
    *(
        SceneCheck(measure, OURS, everything=True)
        for measure in (
            change_by_light,
            found_by_window,
            found_by_differences,
            found_by_threshold,
            starts_beside,
        )
    ),
)
"""All that is measured on scenes."""
