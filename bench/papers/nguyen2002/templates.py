"""What becomes of a template when something is done to the target: NG-11 to 14 and 19.

The template is that of the tracker, kept on the target by its own parts (`follower`); no occlusion
is handled, every view is taken. A template's error is |g - truth|, the mean over components, each
in its standard deviations over the template, and over pixels; the truth is that of the next frame.
Parameters are those of `as-written` unless they are columns. A share or a yes or no is a float in
[0, 1].
"""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.metrics.centre_error import centre_error
from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.follower import (
    COLOURS,
    FEATURES,
    Follower,
    Patch,
    View,
    clear_frames,
    few,
    mask_in,
    tried,
    turned,
    wholly_seen,
)
from bench.papers.scenes import Tables, with_gain
from datasets import Sequence
from trackers.base.interface import Box, Image, Mask
from trackers.templates.appearance import Features, Seen

__all__ = ["adaptation", "by_norm", "changed", "corners", "gain_of", "gates"]

Array = NDArray[np.float64]
Shown = Callable[[int, Image, Box], tuple[Image, Mask]]
"""A frame with something on the target, and a mask of what."""

BEFORE = 10  # frames before something is slid over the target

HIDDEN_FRAMES = 5  # of a partial occlusion: as long as pixels may be outliers
AFTER = 5  # frames after it
LEAST_SEEN = 31  # frames in a row in which the target must be wholly seen for it
COVERED = 0.2  # share of the target that it hides, below γ

NORMS = ("huber", "quadratic")
COVERAGES = (0.1, 0.15, 0.2, 0.25)  # shares of the target
COVERED_FRAMES = 10

LEAST_FRAMES, MOST_FRAMES = 15, 60  # in which corners are looked at
SETTLED = 5  # frames before these count
LEAST_BACKGROUND = 0.1  # share of the template

LATER = 20  # frames from a lasting change to where its outliers are counted
CHANGED_PART = np.array([0.25, 0.3, 0.5, 0.3])
"""x, y, width and height, in shares of the box: an eighth of it and a bit."""

STEADY, CHANGING = 25, 15  # frames before a change of light or orientation, and in it
LEARNT = 15  # frames before any counts: the first covariance must have left the mean of K = 10
LEAST_LIGHT = 0.6
MOST_TURN = 12.0  # degrees

Change = Callable[[Image, Box, float], Image]
CHANGES: dict[str, Change] = {
    "dimming": lambda image, _, progress: with_gain(image, 1 - progress * (1 - LEAST_LIGHT)),
    "turning": lambda image, box, progress: turned(image, box, progress * MOST_TURN),
}
"""A frame, the target's box and how far the change has gone."""


def gates(sequence: Sequence, quick: bool) -> Tables:
    """What a short partial occlusion leaves in the template, with the gate and without (NG-11).

    `ng-11`, of a fifth of the target for five frames: `features`, `gate` (`on`, `off`),
    `template_error` (of what is seen; mean over the frames of the occlusion and five after it),
    `covered_error` (of what is covered; mean over the occlusion), `overlap`, `centre_error`
    [pixels] (both as `template_error`).
    """
    return tried("ng-11", sequence, LEAST_SEEN, _contamination, few(quick), gate=("on", "off"))


def _contamination(part: Sequence, features: Features, gate: str) -> dict[str, float]:
    follower = Follower(part[0], part.boxes[0], features, gate=gate == "on")
    end = BEFORE + HIDDEN_FRAMES
    boxes, visible, covered = [], [], []
    seen = part[: end + AFTER]
    for frame, view, mask in _taken(follower, seen, _covering(part, COVERED, end)):
        if frame < BEFORE:
            continue
        boxes.append(follower.box(view.pose))
        errors = follower.errors(part[frame + 1], part.boxes[frame + 1])
        hidden = follower.on_template(mask, part.boxes[frame])
        visible.append(errors[~hidden].mean())
        if frame < end:
            covered.append(errors[hidden].mean())
    return {
        "template_error": float(np.mean(visible)),
        "covered_error": float(np.mean(covered)),
        **_apart(seen.boxes[BEFORE:], boxes),
    }


def by_norm(sequence: Sequence, quick: bool) -> Tables:
    """Where a target that is partly covered is found, by the norm of the matching error (NG-19).

    `ng-19`, a share of the target that is hidden for ten frames a row: `features`, `norm` (`huber`,
    `quadratic`), `coverage`, `centre_error` [pixels], `overlap`.
    """
    ways = {"norm": NORMS, "coverage": COVERAGES}
    return tried("ng-19", sequence, BEFORE + COVERED_FRAMES, _found, few(quick), **ways)


def _found(part: Sequence, features: Features, norm: str, coverage: float) -> dict[str, float]:
    follower = Follower(part[0], part.boxes[0], features, norm=norm)
    views = _taken(follower, part, _covering(part, coverage, len(part)))
    boxes = [follower.box(view.pose) for frame, view, _ in views if frame >= BEFORE]
    return _apart(part.boxes[BEFORE:], boxes)


def corners(sequence: Sequence, quick: bool) -> Tables:
    """Whether what of a template is background is told by its outliers (NG-12).

    `ng-12`, of clips whose template is background for a tenth or more: `features`, `part`
    (`corners`: whatever shows the background; `three times inside`), `background` (share of the
    template), `flagged` (share of the part that are outliers, mean over frames; of the second,
    three times it).
    """
    part = wholly_seen(sequence, LEAST_FRAMES, LEAST_FRAMES if quick else MOST_FRAMES)
    if part is None:
        return {}
    rows = []
    for features in few(quick):
        follower = Follower(part[0], part.boxes[0], features)
        background = 1 - float(follower.on_template(mask_in(part, 0), part.boxes[0]).mean())
        if background < LEAST_BACKGROUND:
            return {}
        outside, inside = _flagged(follower, part)
        for label, flagged in {"corners": outside, "three times inside": 3 * inside}.items():
            labels = {"features": features, "part": label}
            rows.append(labels | {"background": background, "flagged": flagged})
    return {"ng-12": pd.DataFrame(rows)}


def _flagged(follower: Follower, part: Sequence) -> tuple[float, float]:
    """Mean shares of outliers among pixels that show the background, and the target."""
    shares = []
    for frame, view, _ in _taken(follower, part):
        if frame >= SETTLED:
            target = follower.on_template(mask_in(part, frame), part.boxes[frame])
            outliers = view.seen.outliers
            shares.append((outliers[~target].mean(), outliers[target].mean()))
    outside, inside = np.mean(shares, axis=0).tolist()
    return outside, inside


def changed(sequence: Sequence, quick: bool) -> Tables:
    """What becomes of pixels whose appearance has changed for good (NG-13).

    `ng-13`: `features`, `rebootstrap` (`on`, `off`), `flagged` (share of the changed pixels that
    are outliers 20 frames later), `flagged_others`, `outliers` (share of all).
    """
    ways = {"rebootstrap": ("on", "off")}
    return tried("ng-13", sequence, BEFORE + LATER + 1, _changed, few(quick), **ways)


def _changed(part: Sequence, features: Features, rebootstrap: str) -> dict[str, float]:
    follower = Follower(part[0], part.boxes[0], features, rebootstrap=rebootstrap == "on")
    patch = Patch(part[0], part.boxes[0])

    def shown(frame: int, image: Image, box: Box) -> tuple[Image, Mask]:
        return patch.stuck_on(image, box, CHANGED_PART) if frame >= BEFORE else _as_it_is(image)

    *_, (_, view, mask) = _taken(follower, part, shown)
    there = follower.on_template(mask, part.boxes[-1])
    return {
        "flagged": float(view.seen.outliers[there].mean()),
        "flagged_others": float(view.seen.outliers[~there].mean()),
        "outliers": view.seen.share,
    }


def adaptation(sequence: Sequence, quick: bool) -> Tables:
    """State noise, gain and template while light or orientation change (NG-14).

    `ng-14`, a change and phase a row: `change` (`dimming`, to .6 in 15 frames; `turning`, by 12° in
    15 frames; of a recording with lamps `lamp off` and `lamp on`, as they are), `features`,
    `adaptive` (`on`, `off`: C_w stays 0), `phase` (`before`, `change`), `state_noise` (trace of C_w
    over that of R̄), `gain` (mean eigenvalue of K), `template_error`; means over ten frames before,
    fifteen in it.
    """
    cases: list[tuple[str, Sequence, Change]] = []
    part = wholly_seen(sequence, STEADY + CHANGING, STEADY + CHANGING)
    if part is not None:
        cases += [(label, part, change) for label, change in CHANGES.items()]
    cases += [(label, there, lambda image, *_: image) for label, there in _switches(sequence)]
    rows = [
        {"change": label, "features": features, "adaptive": noise, **row}
        for label, there, change in cases
        for features in (COLOURS if quick else FEATURES)
        for noise in ("on", "off")
        for row in _phases(there, features, noise == "on", change)
    ]
    return {"ng-14": pd.DataFrame(rows)}


def _switches(sequence: Sequence) -> list[tuple[str, Sequence]]:
    """Parts about the frames in which a lamp is switched, the target being wholly seen."""
    lamp = sequence.attributes.get("lamp off")
    if lamp is None:
        return []
    parts, clear = [], clear_frames(sequence)
    for frame in np.flatnonzero(lamp[1:] != lamp[:-1]) + 1:
        part = sequence[max(0, frame - STEADY) : frame + CHANGING]
        if len(part) == STEADY + CHANGING and clear[frame - STEADY : frame + CHANGING].all():
            parts.append((f"lamp {'off' if lamp[frame] else 'on'}", part))
    return parts


def _phases(
    part: Sequence, features: Features, adaptive: bool, change: Change
) -> list[dict[str, str | float]]:
    """Means before and during a change."""
    follower = Follower(part[0], part.boxes[0], features, adaptive_noise=adaptive)
    images = [
        change(image, box, max(0, frame - STEADY + 1) / CHANGING)
        for frame, (image, box) in enumerate(zip(part, part.boxes, strict=True))
    ]
    seen = []
    for frame in range(1, len(part) - 1):
        view, before = follower.look(images[frame]), follower.appearance.template.copy()
        follower.take(view)
        appearance = follower.appearance
        seen.append(
            {
                "state_noise": np.trace(appearance.state) / np.trace(appearance.residual),
                "gain": gain_of(view.seen, before, appearance.template),
                "template_error": follower.errors(images[frame + 1], part.boxes[frame + 1]).mean(),
            }
        )
    courses = pd.DataFrame(seen, index=range(1, len(part) - 1))
    phases = {"before": courses.loc[LEARNT : STEADY - 1], "change": courses.loc[STEADY:]}
    return [
        {"phase": phase, **{str(name): value for name, value in rows.mean().items()}}
        for phase, rows in phases.items()
    ]


def gain_of(seen: Seen, before: Array, after: Array) -> float:
    """Mean eigenvalue of K (equation 9), by how far a view moved the template's inliers to it."""
    inliers = ~seen.outliers
    residuals = (seen.features - before)[inliers]
    gain, *_ = np.linalg.lstsq(residuals, (after - before)[inliers])
    return float(np.trace(gain)) / len(gain)


def _taken(
    follower: Follower, part: Sequence, shown: Shown | None = None
) -> Iterator[tuple[int, View, Mask]]:
    """Frame, view and mask of all frames after the first; every view is taken."""
    for frame in range(1, len(part)):
        image, box = part[frame], part.boxes[frame]
        image, mask = shown(frame, image, box) if shown else _as_it_is(image)
        view = follower.look(image)
        follower.take(view)
        yield frame, view, mask


def _as_it_is(image: Image) -> tuple[Image, Mask]:
    return image, np.zeros(image.shape[:2], np.bool_)


def _covering(part: Sequence, share: float, end: int) -> Shown:
    """Something of the ground over a share of the target, from `BEFORE` to before a frame."""
    patch = Patch(part[0], part.boxes[0])
    return lambda frame, image, box: patch.slid_over(
        image, box, share if BEFORE <= frame < end else 0.0
    )


def _apart(truth: Array, boxes: list[Box]) -> dict[str, float]:
    found = np.array(boxes)
    return {
        "overlap": float(overlap(truth, found).mean()),
        "centre_error": float(centre_error(truth, found).mean()),
    }
