"""What claims ask of the scenes and no run of the tracker shows; on which scenes, see `CHECKS`.

A function measures one thing on a scene, in fewer frames where it is to be quick; it gives tables
by name, in which a row is a frame and what is varied in it. Shares are in [0, 1]. ρ is the
Bhattacharyya coefficient of an ellipse with the model of the true one in the first frame, with the
text's bins, kernel and σ but for what is varied. "Clutter" are ellipses of the target's size within
three widths that a score would call a miss. What needs runs of the tracker is in `short_runs`.
"""

from math import ceil
from typing import cast

import cv2
import numpy as np
import pandas as pd
from scipy.cluster.vq import kmeans2

import trackers
from bench.papers.nummiaro2003.models import (
    Array,
    Histogram,
    Mixture,
    Model,
    clear_frames,
    clutter,
    ellipses_in,
    first_model,
    grid,
    shown,
)
from bench.papers.nummiaro2003.short_runs import entrance, kick_offs, maximum, own_models
from bench.papers.scenes import SceneCheck, Tables, spaced, turned_about, with_gain, with_noise
from datasets import Sequence
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.ellipses import KERNELS
from trackers.histograms.target_model import Background, spacing_of
from trackers.nummiaro2003 import Nummiaro2003

__all__ = ["CHECKS", "background", "bins_and_noise", "gains", "kernels", "occlusion"]
__all__ += ["one_of_two_colours", "threshold", "turned", "turned_and_scaled", "turned_histogram"]

VISIBLE = 0.8  # fraction from which a target counts as visible
HALF_SEEN = 0.5  # likewise, where its boundary may be hidden
HALF_HIDDEN = 0.4, 0.6  # visible fractions of a target that is hidden by half
FINE_STEP = 0.25  # of "all the positions" of the background [Hx]; nearer ones are hardly new
STEPS_A_HALF_AXIS = 8  # of the search for a centre
STEPS_A_WIDTH = 2  # of clutter, where fine histograms take long

DEGREES = (15, 30, 45, 60, 75, 90, 120, 150, 180)
FACTORS = (0.5, 0.65, 0.8, 1.25, 1.6, 2.0)
GAINS = (0.5, 0.75, 1.25, 1.5)
BINS = (4, 8, 16, 32)  # a channel
NOISES = (0, 2, 4, 8, 16)  # deviations [grey levels]


def background(sequence: Sequence, quick: bool) -> Tables:
    """Whether the threshold tells target from background (NU-11, NU-11b; Equations 13 to 15).

    `appearance`: `above_threshold` (1: ρ of the true ellipse is), in frames that show more than
    .8 of the target. `background`: `below_threshold` (share of the frame's `positions`).
    """
    target = ellipses_in(sequence.boxes[sequence.first_frame])
    model = first_model(sequence)
    frame_of_threshold, least = threshold(sequence, model)
    appearance = [
        {"frame": frame, "above_threshold": float(model.coefficient(image, ellipse) > least)}
        for frame, image, ellipse in shown(
            sequence, clear_frames(sequence, 5 if quick else 50, VISIBLE)
        )
    ]
    others = spaced(np.arange(len(sequence)), 2 if quick else 5)
    positions = []
    for frame in sorted({frame_of_threshold, *others}):
        found = _without_target(sequence, frame, target[2:], model)
        if len(found):
            below = float(np.mean(found <= least))
            positions.append({"frame": frame, "positions": len(found), "below_threshold": below})
    return {"appearance": pd.DataFrame(appearance), "background": pd.DataFrame(positions)}


def occlusion(sequence: Sequence, quick: bool) -> Tables:
    """How much of a target must be seen for its ellipse to look like it (NU-1).

    `occlusion_curve`: `visibility`, `seen` (the fifth that it lies in, in %), `coefficient` (ρ of
    the true ellipse), `above_threshold`, in frames that hide a part of the target, by how much.
    `occlusion`: those of them that hide half of it.
    """
    model = first_model(sequence)
    _, least = threshold(sequence, model)
    visibility = sequence.visibility
    partly = np.flatnonzero(sequence.present & (visibility > 0) & (visibility < 1))
    low, high = HALF_HIDDEN
    half = partly[(visibility[partly] >= low) & (visibility[partly] <= high)].tolist()
    rows = []
    for frame, image, ellipse in shown(sequence, {*spaced(partly, 10 if quick else 100), *half}):
        coefficient, most = model.coefficient(image, ellipse), 20 * ceil(5 * visibility[frame])
        rows.append(
            {
                "frame": frame,
                "visibility": float(visibility[frame]),
                "seen": f"{most - 20} to {most}",
                "coefficient": coefficient,
                "above_threshold": float(coefficient > least),
            }
        )
    curve = pd.DataFrame(rows).sort_values("visibility") if rows else pd.DataFrame()
    return {
        "occlusion": curve[curve["frame"].isin(half)] if rows else curve,
        "occlusion_curve": curve,
    }


def turned_and_scaled(sequence: Sequence, quick: bool) -> Tables:
    """ρ of a target that is turned or scaled about its centre, with the model before (NU-2).

    `transformed`: `transformation` (`rotation`, `scale`), `amount` (degrees, factor),
    `coefficient` of the ellipse that is turned or scaled like the target. `transformed_upright`,
    for rotations alone, what a state of the tracker can say: `region` (the upright ellipse in the
    turned one's extents; the greatest circle in it, in the model too).
    """
    whole, upright = [], []
    for frame, image, ellipse in shown(sequence, clear_frames(sequence, 1 if quick else 5)):
        patch, centred = _cut_out(image, ellipse)
        model = Model(patch, centred)
        for degrees in DEGREES:
            view = turned(patch, centred, degrees)
            histogram = turned_histogram(view, centred, degrees)
            labels = {"frame": frame, "transformation": "rotation", "amount": float(degrees)}
            whole.append(
                labels | {"coefficient": float(np.sqrt(model.histogram * histogram).sum())}
            )
            for region, before, after in _upright(centred, degrees):
                changed = Model(patch, before).coefficient(view, after)
                upright.append(labels | {"region": region, "coefficient": changed})
        for factor in FACTORS:
            # A camera farther away averages; one nearer makes no colours between neighbours.
            way = cv2.INTER_AREA if factor < 1 else cv2.INTER_NEAREST
            resized = cv2.resize(patch, None, fx=factor, fy=factor, interpolation=way)
            scaled = np.asarray(resized, np.uint8)
            sizes = np.array([scaled.shape[1] / patch.shape[1], scaled.shape[0] / patch.shape[0]])
            changed = model.coefficient(scaled, centred * np.tile(sizes, 2))
            labels = {"frame": frame, "transformation": "scale", "amount": factor}
            whole.append(labels | {"coefficient": changed})
    return {"transformed": pd.DataFrame(whole), "transformed_upright": pd.DataFrame(upright)}


def kernels(sequence: Sequence, quick: bool) -> Tables:
    """Which weights of the pixels set the target off from clutter, and find its centre (NU-5).

    `kernels`: `kernel`, `margin` (ρ of the true ellipse less the greatest of clutter),
    `centre_error` (from the truth to the greatest ρ within a Hx, at the true size [Hx]), in frames
    that show half of the target.
    """
    models = {kernel: first_model(sequence, kernel=kernel) for kernel in KERNELS}
    rows = []
    frames = clear_frames(sequence, 3 if quick else 20, HALF_SEEN)
    for frame, image, ellipse in shown(sequence, frames):
        half_width = float(ellipse[2])
        near = grid(ellipse, (half_width, half_width), half_width / STEPS_A_HALF_AXIS)
        far = clutter(ellipse, image)
        for kernel, model in models.items():
            best = near[model.coefficients(image, near).argmax()]
            error = float(np.hypot(*(best - ellipse)[:2])) / half_width
            margin = model.coefficient(image, ellipse) - float(model.coefficients(image, far).max())
            rows.append({"kernel": kernel, "frame": frame, "margin": margin, "centre_error": error})
    return {"kernels": pd.DataFrame(rows)}


def gains(sequence: Sequence, quick: bool) -> Tables:
    """How much a target looks like itself in other light, by RGB and by HSV (NU-6).

    `lighting`: `colour` (`rgb`, `hsv`), `gain` (of the image), `coefficient`.
    """
    models = {space: first_model(sequence, JointBins(space)) for space in ("rgb", "hsv")}
    rows = [
        {"colour": space, "frame": frame, "gain": gain, "coefficient": coefficient}
        for frame, image, ellipse in shown(sequence, clear_frames(sequence, 1 if quick else 5))
        for space, model in models.items()
        for gain in GAINS
        for coefficient in [model.coefficient(with_gain(image, gain), ellipse)]
    ]
    return {"lighting": pd.DataFrame(rows)}


def bins_and_noise(sequence: Sequence, quick: bool) -> Tables:
    """Whether many bins are a problem where the camera adds noise (NU-25).

    `noise`: `bins` (a channel), `noise` (deviation of what is added [grey levels]), `coefficient`,
    `margin` (as of `kernels`).
    """
    generator = np.random.default_rng(0)
    first = sequence.first_frame
    start = ellipses_in(sequence.boxes[first])
    frames = clear_frames(sequence, 1 if quick else 5)
    rows = []
    for noise in NOISES:
        view = with_noise(sequence[first], noise, generator)
        models = {bins: Model(view, start, JointBins("rgb", bins)) for bins in BINS}
        for frame, image, ellipse in shown(sequence, frames):
            view = with_noise(image, noise, generator)
            around = np.vstack([ellipse, clutter(ellipse, view, STEPS_A_WIDTH)])
            for bins, model in models.items():
                own, *others = model.coefficients(view, around).tolist()
                labels = {"frame": frame, "bins": bins, "noise": noise}
                rows.append(labels | {"coefficient": own, "margin": own - max(others)})
    return {"noise": pd.DataFrame(rows)}


def threshold(sequence: Sequence, model: Model) -> tuple[int, float]:
    """The appearance condition as the tracker makes it: the frame that it is from, and μ + 2σ.

    It is from the last frame without the target, where the sequence begins with such; else
    from the first frame without the target's surroundings.
    """
    first = sequence.first_frame
    frame = max(first - 1, 0)
    target = ellipses_in(sequence.boxes[first])
    image = sequence[frame]
    tracker = cast(Nummiaro2003, trackers.create("nummiaro2003"))
    positions = tracker.parameters.background_positions
    spacing = spacing_of(positions, target[2:], (image.shape[1], image.shape[0]))
    without = target[:2] if frame == first else None
    return frame, _background(image, target[2:], spacing, without).threshold(model.histogram)


def turned(image: Image, ellipse: Array, degrees: float) -> Image:
    """The image turned about an ellipse's centre, against the clock as it is seen."""
    # Colours between neighbours, which interpolation would make, are not the target's.
    return turned_about(image, ellipse[:2], degrees, cv2.INTER_NEAREST)


def turned_histogram(image: Image, ellipse: Array, degrees: float) -> Array:
    """Histogram of an ellipse that was turned with the image, kernel as written."""
    colours = JointBins()
    rows, columns = np.mgrid[: image.shape[0], : image.shape[1]] + 0.5
    dx, dy = columns - ellipse[0], rows - ellipse[1]
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    along = (cosine * dx - sine * dy) / ellipse[2]
    across = (sine * dx + cosine * dy) / ellipse[3]
    inside = along**2 + across**2 <= 1
    distance = (dx**2 + dy**2) / (ellipse[2:] ** 2).sum()
    weights = 1 - distance[inside]
    counts = np.bincount(colours.codes(image)[inside], weights, colours.n_bins)
    return np.asarray(counts / counts.sum())


def one_of_two_colours(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """How far a model sets an object with one of the target's colours off from the target (NU-27).

    Pixels of the target in a later frame are told apart by the nearer of its two main colours; the
    distractor consists of those of the more frequent one alone, all of them counted alike.
    `mixture`: `model` (`histogram`, `mixture`), `target`, `distractor` (log likelihoods, of the
    mixture a pixel's mean), `separation`: their difference as a share of that between target and
    mean clutter; 0 if the distractor matches as well as the target, 1 if no better than clutter.
    """
    first = sequence.first_frame
    pixels = _pixels(sequence[first], ellipses_in(sequence.boxes[first]))
    models: dict[str, Histogram | Mixture] = {
        "histogram": Histogram(pixels),
        "mixture": Mixture(pixels),
    }
    colours, labels = kmeans2(pixels.astype(np.float64), 2, minit="++", rng=0)
    frequent = np.bincount(labels, minlength=2).argmax()
    rows = []
    for frame, image, ellipse in shown(sequence, clear_frames(sequence, 2 if quick else 10)):
        both = _pixels(image, ellipse)
        offsets = both.astype(np.float64)[:, np.newaxis] - colours
        one_colour = both[(offsets**2).sum(axis=2).argmin(axis=1) == frequent]
        others = [_pixels(image, other) for other in clutter(ellipse, image, 1)]
        for name, model in models.items():
            target, distractor = model.score(both), model.score(one_colour)
            beside = float(np.mean([model.score(other) for other in others]))
            rows.append(
                {
                    "model": name,
                    "frame": frame,
                    "target": target,
                    "distractor": distractor,
                    "separation": (target - distractor) / (target - beside),
                }
            )
    return {"mixture": pd.DataFrame(rows)}


def _without_target(sequence: Sequence, frame: int, half_axes: Array, model: Model) -> Array:
    """ρ of ellipses of a size all over a frame; none whose box meets the true one."""
    everywhere = _background(sequence[frame], half_axes, FINE_STEP * float(half_axes[0]), None)
    found = everywhere.coefficients(model.histogram)
    if not sequence.present[frame]:
        return found
    target = ellipses_in(sequence.boxes[frame])
    apart = (np.abs(everywhere.positions - target[:2]) >= half_axes + target[2:]).any(axis=1)
    return np.asarray(found[apart])


def _background(
    image: Image, half_axes: Array, spacing: float, without: Array | None
) -> Background:
    return Background(SharedFrame(image), half_axes, spacing, JointBins(), "isotropic", without)


def _upright(ellipse: Array, degrees: float) -> list[tuple[str, Array, Array]]:
    """Upright ellipses to compare: what it is called, before, after the turn."""
    half_width, half_height = ellipse[2:]
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    extents = [
        np.hypot(half_width * cosine, half_height * sine),
        np.hypot(half_width * sine, half_height * cosine),
    ]
    circle = np.array([*ellipse[:2], *[min(half_width, half_height)] * 2])
    return [
        ("upright ellipse in its extents", ellipse, np.array([*ellipse[:2], *extents])),
        ("greatest circle in it, upright anyway", circle, circle),
    ]


def _cut_out(image: Image, ellipse: Array) -> tuple[Image, Array]:
    """The target's surroundings, mirrored where the image ends, and the ellipse in them."""
    reach = ceil(float(np.hypot(*ellipse[2:]))) + 2
    padded = cv2.copyMakeBorder(image, reach, reach, reach, reach, cv2.BORDER_REFLECT)
    left, top = np.floor(ellipse[:2]).astype(int).tolist()  # less than the centre by < 1
    patch = padded[top : top + 2 * reach + 1, left : left + 2 * reach + 1]
    centred = ellipse.copy()
    centred[:2] += reach - np.array([left, top])
    return np.ascontiguousarray(patch), centred


def _pixels(image: Image, ellipse: Array) -> Image:
    """Pixels of an ellipse, shape (n, 3)."""
    rows, columns = np.ogrid[: image.shape[0], : image.shape[1]]
    across = (columns + 0.5 - ellipse[0]) / ellipse[2]
    down = (rows + 0.5 - ellipse[1]) / ellipse[3]
    return np.asarray(image[across**2 + down**2 <= 1])


PERSON, STUDENTS = "nummiaro2003/person", "nummiaro2003/students"
EVERY = (PERSON, "nummiaro2003/car", STUDENTS, "nummiaro2003/traffic", "nummiaro2003/head")

CHECKS = (
    SceneCheck(background, EVERY),
    SceneCheck(occlusion, (STUDENTS,)),
    SceneCheck(turned_and_scaled, EVERY),
    SceneCheck(kernels, EVERY),
    SceneCheck(maximum, (PERSON,)),
    SceneCheck(entrance, (PERSON,)),
    SceneCheck(kick_offs, (PERSON,), everything=True),
    SceneCheck(gains, EVERY, everything=True),
    SceneCheck(own_models, (STUDENTS,), everything=True),
    SceneCheck(bins_and_noise, (PERSON,), everything=True),
    SceneCheck(one_of_two_colours, EVERY, everything=True),
)
