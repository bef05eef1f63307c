"""What short runs of the tracker show on scenes: the mean state, doors, models of their own.

A function measures one thing on a scene, for the presets `as-written` and `recommended`, in fewer
frames and repetitions where it is to be quick; it gives tables by name, as `scenes` does. Runs
are not kept.
"""

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any, NamedTuple, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
import trackers
from bench.evaluation.record import Run
from bench.experiments.contestant import run_seed
from bench.metrics.centre_error import centre_inside
from bench.papers.nummiaro2003.models import (
    Array,
    Model,
    clear_frames,
    clutter,
    ellipses_in,
    first_model,
    grid,
)
from bench.papers.scenes import Tables, short_runs
from datasets import Sequence, SequenceError
from datasets.synthetic.nummiaro2003 import entries
from trackers.base.interface import Estimate, Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.counting import ellipse_histograms
from trackers.nummiaro2003 import Nummiaro2003

__all__ = ["begun_empty", "entered", "entrance", "kick_offs", "maximum", "nearer", "own_models"]

NAME = "nummiaro2003"
PRESETS = ("as-written", "recommended")
ELLIPSE = ["x", "y", "half_width", "half_height"]

RUN = 100  # frames of the run whose mean state is compared with the maximum
REACH = 1.5  # of the surface, to each side [half axes]
NEAR = 0.25  # [Hx]

AS_WRITTEN = 0.1  # the kick-off fraction b
KICK_OFFS = (0.05, AS_WRITTEN, 0.2, 0.4)
VISIBLE = 0.8  # fraction from which a target that enters counts as visible
WHOLE = 0.99  # likewise, as wholly visible
IN_TIME = 10  # frames
WATCHED = 40  # frames from when the target is visible to the end
PICTURED = (-10, 0, IN_TIME)  # frames of Fig. 3, from when it is visible

EVERY = 5  # frames, after which models of the particles' own are looked at
STEPS_A_WIDTH = 2  # of clutter


def maximum(sequence: Sequence, quick: bool) -> Tables:
    """Whether the mean state lies at the greatest ρ, without model update (NU-7, Fig. 2).

    `maximum`: `preset`, `distance` (mean state to the greatest ρ on a grid of a pixel [Hx]),
    `near` (1: at most .25), `spread` (deviation of the particles around their mean [Hx]), in
    frames that show all of the target. `surface` and `surface_particles`, of the last of these
    frames: `preset`, `frame`, `x`, `y`, `coefficient` (ρ); and ellipses by `kind` (`particle`,
    `mean`, `greatest`).
    """
    first = sequence.first_frame
    part = sequence[: first + (20 if quick else RUN)]
    model = first_model(sequence)
    frames = clear_frames(part, 2 if quick else 15)
    if not frames:
        return {}
    rows, surfaces, particles = [], [], []
    texts = [f"{NAME}:preset={preset}:model_update=false" for preset in PRESETS]
    for preset, run in zip(PRESETS, short_runs(part, texts), strict=True):
        for frame in frames:
            surface = _surface(part, run, model, frame)
            labels: dict[str, Any] = {"preset": preset, "frame": frame}
            rows.append(labels | _mean_state(part, run, frame, surface))
            if frame == frames[-1]:
                surfaces.append(surface.assign(**labels))
                particles.append(_ellipses(run, frame, surface).assign(**labels))
    return {
        "maximum": pd.DataFrame(rows),
        "surface": pd.concat(surfaces, ignore_index=True),
        "surface_particles": pd.concat(particles, ignore_index=True),
    }


def entrance(sequence: Sequence, quick: bool) -> Tables:
    """Whether a target that is known by its histogram is found when it comes in (NU-28, Fig. 3).

    On the same scene as it begins without the target. `entrance`: see `entered`; a row a run, with
    b = .1 and the model of the first frame that shows all of the target, not in the shade.
    `entrance_particles` and `entrance_regions`, of the first repetition: ellipses, `tracking` (1)
    or waiting, `weight`; boxes of where samples wait.
    """
    empty = begun_empty(sequence.name)
    regions = entries(empty.name)
    waited = _waited(empty, regions, (AS_WRITTEN,), 2 if quick else 5)
    return {
        "entrance": _entered(empty, waited),
        "entrance_particles": pd.concat(_pictured(empty, waited), ignore_index=True),
        "entrance_regions": pd.DataFrame(regions, columns=["x", "y", "width", "height"]),
    }


def kick_offs(sequence: Sequence, quick: bool) -> Tables:
    """`kick_off`: as `entrance`, with several values of b (NU-12)."""
    empty = begun_empty(sequence.name)
    waited = _waited(empty, entries(empty.name), KICK_OFFS, 1 if quick else 3)
    return {"kick_off": _entered(empty, waited)}


def own_models(sequence: Sequence, quick: bool) -> Tables:
    """What target models of the particles' own come to look like (NU-8).

    `wrong_models`: `preset`, `repetition`, `frame`, `nearer_clutter` (share of the models whose ρ
    with some clutter exceeds that with the first).
    """
    first = sequence.first_frame
    image, box = sequence[first], sequence.boxes[first]
    begun = []
    for preset, repetition in product(PRESETS, range(1 if quick else 2)):
        tracker = _tracker(sequence, repetition, preset=preset, models="per-particle")
        if first > 0:
            tracker.watch(sequence[first - 1])
        tracker.init(image, box)
        begun.append(({"preset": preset, "repetition": repetition}, tracker))
    original = begun[0][1].histogram_of(image, box)
    rows = []
    for frame in range(first + 1, first + 61 if quick else len(sequence)):
        frame_shown = SharedFrame(sequence[frame], len(begun))
        for _, tracker in begun:
            tracker.update_shared(frame_shown)
        if (frame - first) % EVERY or not sequence.present[frame]:
            continue
        image = frame_shown.image
        around = clutter(ellipses_in(sequence.boxes[frame]), image, STEPS_A_WIDTH)
        for labels, tracker in begun:
            models = tracker._model.models
            assert models is not None
            share = nearer(models, original, image, around)
            rows.append({**labels, "frame": frame, "nearer_clutter": share})
    return {"wrong_models": pd.DataFrame(rows)}


def begun_empty(name: str) -> Sequence:
    """The same scene of `person` as it begins without the target."""
    return datasets.load(f"{name}:start=empty")


def entered(
    tracking: NDArray[np.bool_], inside: NDArray[np.bool_], visibility: Array
) -> dict[str, float]:
    """What became of a run that waits for the target.

    Of flags by frame: in which it tracks, and has the centre inside, both false in the first; and
    of the target's visible fraction, 0 while it is absent, above .8 in some frame.
    `false_start_rate`: switches to tracking before there is anything of the target, in a hundred
    frames; `no_false_start`; `kept`: tracks with the centre inside ten frames after the target is
    visible; `started`: likewise, or in some frame before then, where it began to track with the
    target in view.
    """
    empty = int(np.flatnonzero(visibility > 0)[0])
    visible = int(np.flatnonzero(visibility > VISIBLE)[0])
    begins = tracking & ~np.r_[False, tracking[:-1]]
    false_starts = float(np.count_nonzero(begins[:empty]))
    # Of what it follows, where that began: what it took for the target before is not the target.
    since = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), -1))
    on_target = tracking & inside & (since >= empty)
    kept = tracking[visible + IN_TIME] and inside[visible + IN_TIME]
    return {
        "false_start_rate": 100 * false_starts / empty,
        "no_false_start": float(false_starts == 0),
        "started": float(kept or on_target[empty : visible + IN_TIME + 1].any()),
        "kept": float(kept),
    }


def nearer(models: Array, original: Array, image: Image, around: Array) -> float:
    """Share of the models (n, bins) whose ρ with some ellipse exceeds that with the original."""
    colours = JointBins()
    every = np.arange(colours.n_bins)
    found = ellipse_histograms(SharedFrame(image), around, "isotropic", colours, every)
    others = found.counts / np.maximum(found.totals, 1)[:, np.newaxis]
    greatest = (np.sqrt(models) @ np.sqrt(others).T).max(axis=1)
    return float(np.mean(greatest > np.sqrt(models) @ np.sqrt(original)))


def _tracker(sequence: Sequence, repetition: int, **options: str | float) -> Nummiaro2003:
    """The tracker with the random numbers of a repetition, before any frame."""
    seed = run_seed(NAME, sequence.name, repetition)
    return cast(Nummiaro2003, trackers.create(NAME, seed, **options))


def _surface(part: Sequence, run: Run, model: Model, frame: int) -> pd.DataFrame:
    """ρ around the target, at the mean state's size."""
    truth, mean = ellipses_in(part.boxes[frame]), ellipses_in(run.boxes[frame])
    middle = np.concatenate([np.floor(truth[:2]) + 0.5, mean[2:]])
    places = grid(middle, (float(REACH * truth[2]), float(REACH * truth[3])), 1.0)
    values = model.coefficients(part[frame], places)
    return pd.DataFrame(places[:, :2], columns=["x", "y"]).assign(coefficient=values)


def _greatest(surface: pd.DataFrame) -> Array:
    place: Array = surface[["x", "y"]].to_numpy()[surface["coefficient"].argmax()]
    return place


def _mean_state(part: Sequence, run: Run, frame: int, surface: pd.DataFrame) -> dict[str, float]:
    half_width = float(part.boxes[frame, 2] / 2)
    mean, found = ellipses_in(run.boxes[frame]), run.arrays[frame]
    distance = float(np.hypot(*(mean[:2] - _greatest(surface)))) / half_width
    offsets = found["particles"][:, :2] - mean[:2]
    spread = float(np.sqrt(found["weights"] @ (offsets**2).sum(axis=1))) / half_width
    return {"distance": distance, "near": float(distance <= NEAR), "spread": spread}


def _ellipses(run: Run, frame: int, surface: pd.DataFrame) -> pd.DataFrame:
    """Ellipses that a picture shows beside the surface."""
    mean = ellipses_in(run.boxes[frame])
    particles = run.arrays[frame]["particles"][:, [0, 1, 4, 5]]
    drawn = np.vstack([particles, mean, [*_greatest(surface), *mean[2:]]])
    kinds = ["particle"] * len(particles) + ["mean", "greatest"]
    return pd.DataFrame(drawn, columns=ELLIPSE).assign(kind=kinds)


class _Waiting(NamedTuple):
    """A tracker that waits, and what it says from the second frame on."""

    labels: Mapping[str, Any]
    tracker: Nummiaro2003
    estimates: list[Estimate]


def _waited(
    sequence: Sequence, regions: Array, fractions: tuple[float, ...], repetitions: int
) -> list[_Waiting]:
    """Let trackers wait from the first frame on."""
    known = _known(sequence)
    box, view, image = sequence.boxes[known], sequence[known], sequence[0]
    waited = []
    for preset, kick_off, repetition in product(PRESETS, fractions, range(repetitions)):
        tracker = _tracker(sequence, repetition, preset=preset, kick_off=kick_off)
        tracker.init_by_histogram(image, tracker.histogram_of(view, box), box[2:] / 2, regions)
        labels = {"preset": preset, "kick_off": kick_off, "repetition": repetition}
        waited.append(_Waiting(labels, tracker, []))
    for frame in range(1, min(_visible_from(sequence) + WATCHED, len(sequence))):
        frame_shown = SharedFrame(sequence[frame], len(waited))
        for one in waited:
            one.estimates.append(one.tracker.update_shared(frame_shown))
    return waited


def _known(sequence: Sequence) -> int:
    """Frame of the model: the first in which the target is wholly visible, and in the light.

    "The object must be fully visible, so that a good color distribution can be calculated."
    """
    shade = sequence.attributes.get("shade", np.zeros(len(sequence), np.bool_))
    lit = np.flatnonzero(sequence.present & (sequence.visibility >= WHOLE) & ~shade)
    if len(lit) == 0:
        raise SequenceError(
            f"{sequence.name}: the target is never wholly visible in the light, so that its "
            "histogram is not known; take another scene."
        )
    return int(lit[0])


def _visible_from(sequence: Sequence) -> int:
    return int(np.flatnonzero(sequence.present & (sequence.visibility > VISIBLE))[0])


def _entered(sequence: Sequence, waited: list[_Waiting]) -> pd.DataFrame:
    rows = []
    for one in waited:
        n = len(one.estimates) + 1
        boxes = np.array([estimate.box for estimate in one.estimates])
        inside = np.r_[False, centre_inside(sequence.boxes[1:n], boxes)]
        tracking = np.r_[False, [said.details["mode"] == 1 for said in one.estimates]]
        visibility = np.where(sequence.present, sequence.visibility, 0.0)[:n]
        rows.append({**one.labels, **entered(tracking, inside, visibility)})
    return pd.DataFrame(rows)


def _pictured(sequence: Sequence, waited: list[_Waiting]) -> Iterator[pd.DataFrame]:
    """Particles of some frames, and of the one in which the target is found."""
    for one in waited:
        if one.labels["repetition"] != 0:
            continue
        modes = [said.details["mode"] for said in one.estimates]
        found = {modes.index(1.0) + 1} if 1.0 in modes else set()
        for frame in sorted(found | {_visible_from(sequence) + offset for offset in PICTURED}):
            said = one.estimates[frame - 1]
            particles = pd.DataFrame(said.arrays["particles"][:, [0, 1, 4, 5]], columns=ELLIPSE)
            yield particles.assign(
                preset=one.labels["preset"],
                frame=frame,
                tracking=said.details["mode"],
                weight=said.arrays["weights"],
            )
