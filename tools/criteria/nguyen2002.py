"""Criteria of the nguyen2002 scenes; values of clips are medians or extremes over 20 clips."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tools.criteria.shared import SceneImages, box_mask, colour_auc
from trackmark import datasets
from trackmark.datasets.synthetic.render.finish import GAMMA

COMPLETE = 0.02  # visible share up to which an occlusion counts as complete


class ClipSet:
    """Set of clips that counts as one scene."""

    def __init__(self, clips: list[SceneImages]) -> None:
        self.clips = clips
        self.frame_pairs = lru_cache(len(clips))(_frame_pairs)

    @classmethod
    def load(cls, scene: int) -> "ClipSet":
        """Load the 20 clips of the set with the scene's number."""
        names = [f"nguyen2002/clip-{clip:02}:scene={scene}" for clip in range(1, 21)]
        return cls([SceneImages(datasets.load(name)) for name in names])


def light_change_auc(scene: SceneImages, *, switch: str) -> float:
    """Return the AUC of target against ring after a switch, by the colours of the frame before.

    `switch`: `off` or `on`. The first frame after the switch is measured.
    """
    frame = _switch_frame(scene, switch)
    return colour_auc(scene, frame, frame - 1)


def light_ratio(scene: SceneImages, *, switch: str) -> float:
    """Return the target's mean light in the first frame after a switch, relative to before.

    `switch`: `off` or `on`. Grey levels are converted to linear light by the camera's exponent.
    """
    frame = _switch_frame(scene, switch)
    before, after = (np.mean((scene.target_colours(f) / 255) ** GAMMA) for f in (frame - 1, frame))
    return float(after / before)


def _switch_frame(scene: SceneImages, switch: str) -> int:
    """Return the first frame after a lamp is switched `off` or `on`."""
    lamp_off = np.asarray(scene.sequence.attributes["lamp off"]).astype(int)
    return int(np.flatnonzero(np.diff(lamp_off) == (1 if switch == "off" else -1))[0]) + 1


def complete_occlusions(clips: ClipSet) -> float:
    """Return the number of complete occlusions in all clips."""
    return float(len(_hidden_lengths(clips)))


def hidden_frames(clips: ClipSet) -> float:
    """Return the median number of frames for which a complete occlusion hides all of the target."""
    return float(np.median(_hidden_lengths(clips)))


def feature_noise_ratio(clips: ClipSet, *, pairs: int) -> float:
    """Return the ratio of the signal-to-noise ratios of c1c2c3 and RGB in the median clip."""
    ratios = []
    for clip in clips.clips:
        frames = clips.frame_pairs(clip, pairs)
        rgb, invariants = np.median([_signal_to_noise(clip, f) for f in frames], axis=0)
        ratios.append(invariants / rgb)
    return float(np.median(ratios))


def target_saturation(clips: ClipSet, *, pairs: int) -> float:
    """Return the mean of (max - min) / max of the target's colours in the median clip."""
    values = []
    for clip in clips.clips:
        frames = clips.frame_pairs(clip, pairs)
        colours = [clip.target_colours(frame).astype(int) for frame in frames]
        extremes = [(c.max(axis=1), c.min(axis=1)) for c in colours]
        values.append(np.median([np.mean((hi - lo) / np.maximum(hi, 1)) for hi, lo in extremes]))
    return float(np.median(values))


def target_in_box(clips: ClipSet, *, pairs: int) -> float:
    """Return the share of the target's pixels inside its box, in the worst frame of all clips."""
    shares = []
    for clip in clips.clips:
        for frame in clips.frame_pairs(clip, pairs):
            mask = clip.mask(frame)
            inside = box_mask(mask.shape, clip.boxes[frame], 1 + 2 / clip.sides[frame])
            shares.append((mask & inside).sum() / mask.sum())
    return float(min(shares))


def _hidden_lengths(clips: ClipSet) -> list[int]:
    lengths = []
    for clip in clips.clips:
        hidden = np.r_[False, clip.visibility <= COMPLETE, False]
        edges = np.flatnonzero(np.diff(hidden))
        lengths += (edges[1::2] - edges[::2]).tolist()
    return lengths


def _frame_pairs(clip: SceneImages, pairs: int) -> list[int]:
    """Return evenly spaced frames; each frame and the next one show all of the target."""
    whole = clip.visibility > 0.98
    frames = np.flatnonzero(whole[:-1] & whole[1:])
    return [int(frame) for frame in frames[np.linspace(0, len(frames) - 1, pairs).astype(int)]]


def _signal_to_noise(clip: SceneImages, frame: int) -> tuple[float, float]:
    """Return the target's variance divided by that of its change in a frame, for RGB and c1c2c3."""
    shift = np.round(clip.centres[frame + 1] - clip.centres[frame]).astype(int)
    rows, columns = np.nonzero(clip.mask(frame))
    height, width = clip.mask(frame).shape
    later = np.clip(rows + shift[1], 0, height - 1), np.clip(columns + shift[0], 0, width - 1)
    before, after = clip.image(frame)[rows, columns], clip.image(frame + 1)[later]
    return (
        _variance_ratio(before.astype(float), after.astype(float)),
        _variance_ratio(_invariants(before), _invariants(after)),
    )


def _variance_ratio(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    signal, noise = np.cov(before.T), np.cov((after - before).T) / 2
    return float(np.trace(signal @ np.linalg.pinv(noise)) / before.shape[1])


def _invariants(colours: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the ratios c1, c2, c3 (equation 18) of BGR colours of shape (k, 3); black gives 0."""
    values = colours[:, ::-1].astype(float)
    others = [values[:, [j for j in range(3) if j != k]].max(axis=1) for k in range(3)]
    return np.asarray(values / np.maximum(np.stack(others, axis=1), 1.0))
