"""Static criteria of scenes: measured on images and ground truth, before any tracker runs.

A criterion is a function of a `SceneImages` that returns one number. `criteria.toml` of a paper
names the function, its options, the target and the sentence of the paper that asks for it.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

import datasets
from datasets.interface import Image, Mask

CACHED_FRAMES = 512


class SceneImages:
    """Images and ground truth of one scene; images and masks are rendered once.

    Parameters
    ----------
    sequence : datasets.Sequence
        The scene.

    Attributes
    ----------
    boxes : ndarray of float64, shape (n, 4)
        Ground truth `[x, y, width, height]` in pixels; NaN rows where the target is out of view.
    visibility : ndarray of float64, shape (n,)
        Visible share of the target in [0, 1].
    """

    def __init__(self, sequence: datasets.Sequence) -> None:
        self.sequence = sequence
        self.boxes = sequence.boxes
        self.visibility = sequence.visibility
        self.image = lru_cache(CACHED_FRAMES)(self._image)
        self.mask = lru_cache(CACHED_FRAMES)(self._mask)

    def __len__(self) -> int:
        return len(self.boxes)

    @property
    def centres(self) -> NDArray[np.float64]:
        """Centres of the boxes in pixels, shape (n, 2)."""
        return np.asarray(self.boxes[:, :2] + self.boxes[:, 2:] / 2)

    @property
    def sides(self) -> NDArray[np.float64]:
        """Mean side of each box in pixels, shape (n,)."""
        return np.asarray(self.boxes[:, 2:].mean(axis=1))

    def _image(self, frame: int) -> Image:
        return self.sequence[frame]

    def _mask(self, frame: int) -> Mask:
        mask = self.sequence.mask(frame)
        if mask is None:
            raise ValueError(f"{self.sequence.name}: frame {frame} has no mask.")
        return mask.astype(bool)

    def target_colours(self, frame: int) -> NDArray[np.uint8]:
        """Colours of the target's visible pixels, shape (k, 3)."""
        return np.asarray(self.image(frame)[self.mask(frame)])

    def ring_colours(self, frame: int, scale: float = 2.0) -> NDArray[np.uint8]:
        """Colours around the target: `scale` times the box, without the target, shape (k, 3)."""
        around = box_mask(self.mask(frame).shape, self.boxes[frame], scale)
        return np.asarray(self.image(frame)[around & ~self.mask(frame)])


# Shared


def box_mask(
    shape: tuple[int, ...], box: NDArray[np.float64], scale: float = 1.0
) -> NDArray[np.bool_]:
    """Pixels inside a box that is enlarged about its centre by `scale`."""
    height, width = shape[:2]
    x, y, box_width, box_height = box
    rows, columns = np.mgrid[:height, :width]
    inside_x = np.abs(columns + 0.5 - x - box_width / 2) <= box_width * scale / 2
    return np.asarray(
        inside_x & (np.abs(rows + 0.5 - y - box_height / 2) <= box_height * scale / 2)
    )


def colour_histogram(colours: NDArray[np.uint8], bins: int = 8) -> NDArray[np.float64]:
    """Normalised RGB histogram of colours of shape (k, 3), with `bins`³ bins."""
    cells = colours.astype(int) * bins // 256
    index = (cells[:, 0] * bins + cells[:, 1]) * bins + cells[:, 2]
    counts = np.bincount(index, minlength=bins**3).astype(float)
    return np.asarray(counts / max(counts.sum(), 1.0))


def bhattacharyya(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Bhattacharyya distance of two normalised histograms, in [0, 1]."""
    return float(np.sqrt(max(0.0, 1.0 - np.sqrt(first * second).sum())))


def auc(scores: NDArray[np.float64], is_target: NDArray[np.bool_]) -> float:
    """Area under the ROC curve of scores: how well they separate the target from the rest."""
    _, inverse, counts = np.unique(scores, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - (counts - 1) / 2)[inverse]
    n_target = int(is_target.sum())
    n_rest = len(is_target) - n_target
    return float((ranks[is_target].sum() - n_target * (n_target + 1) / 2) / (n_target * n_rest))


def colour_model(
    colours: NDArray[np.uint8], bins: int = 12, floor: float = 0.05
) -> NDArray[np.float64]:
    """Logarithm of a smoothed RGB histogram with `bins`³ bins."""
    counts = colour_histogram(colours, bins) * len(colours) + floor
    return np.asarray(np.log(counts / counts.sum()))


def colour_auc(scene: SceneImages, frame: int, model_frame: int, scale: float = 2.2) -> float:
    """Separability of target and ring in `frame` by the colours of `model_frame`."""
    ratio = colour_model(scene.target_colours(model_frame)) - colour_model(
        scene.ring_colours(model_frame, scale)
    )
    target, ring = scene.target_colours(frame), scene.ring_colours(frame, scale)
    colours = np.concatenate([target, ring]).astype(int) * 12 // 256
    scores = ratio[(colours[:, 0] * 12 + colours[:, 1]) * 12 + colours[:, 2]]
    return auc(scores, np.arange(len(colours)) < len(target))


def speeds(scene: SceneImages) -> NDArray[np.float64]:
    """Speed of the box's centre from frame to frame in pixels, shape (n - 1,)."""
    steps = np.diff(scene.centres, axis=0)
    return np.asarray(np.hypot(steps[:, 0], steps[:, 1]))


def slow_share(scene: SceneImages, *, limit: float) -> float:
    """Share of the frames in which the target moves by less than `limit` pixels."""
    return float(np.nanmean(speeds(scene) < limit))


def median_speed(scene: SceneImages) -> float:
    """Median speed in pixels per frame."""
    return float(np.nanmedian(speeds(scene)))


def relative_speed(scene: SceneImages, *, percentile: float) -> float:
    """Percentile of the speed in mean box sides per frame."""
    return float(np.nanpercentile(speeds(scene) / scene.sides[:-1], percentile))


def area_ratio(scene: SceneImages) -> float:
    """Largest over smallest area of the boxes."""
    areas = scene.boxes[:, 2] * scene.boxes[:, 3]
    return float(np.nanmax(areas) / np.nanmin(areas))


def background_in_first_box(scene: SceneImages) -> float:
    """Share of the first box that does not show the target."""
    frame = scene.sequence.first_frame
    inside = box_mask(scene.mask(frame).shape, scene.boxes[frame])
    return float(1.0 - (scene.mask(frame) & inside).sum() / inside.sum())


def ring_distance(scene: SceneImages, frame: int) -> float:
    """Bhattacharyya distance of the target's colours and those around it."""
    return bhattacharyya(
        colour_histogram(scene.target_colours(frame)), colour_histogram(scene.ring_colours(frame))
    )


def longest_stretch(flags: NDArray[np.bool_]) -> int:
    """Length of the longest run of true values, in frames."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False]))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def longest_hidden(scene: SceneImages, *, visible: float) -> float:
    """Longest stretch of frames in which less than `visible` of the target is seen."""
    return float(longest_stretch(scene.visibility < visible))


# wang2010


# moreno2005


# multipart


# nummiaro2003


# nguyen2002

COMPLETE = 0.02  # visible share up to which an occlusion counts as complete


class ClipSet:
    """The clips of one set, over which criteria take a median or a worst case."""

    def __init__(self, clips: list[SceneImages]) -> None:
        self.clips = clips
        self.frame_pairs = lru_cache(len(clips))(_frame_pairs)

    @classmethod
    def load(cls, scene: int) -> "ClipSet":
        """Load the 20 clips of a set by the scene's number."""
        names = [f"nguyen2002/clip-{clip:02}:scene={scene}" for clip in range(1, 21)]
        return cls([SceneImages(datasets.load(name)) for name in names])


def light_change_auc(scene: SceneImages, *, switch: str) -> float:
    """Separability of target and ring by the colours of the frame before the lamp's `switch`.

    `switch` is `off` or `on`; the frame is the first after the switch.
    """
    lamp_off = np.asarray(scene.sequence.attributes["lamp off"]).astype(int)
    frame = int(np.flatnonzero(np.diff(lamp_off) == (1 if switch == "off" else -1))[0]) + 1
    return colour_auc(scene, frame, frame - 1)


def complete_occlusions(clips: ClipSet) -> float:
    """Number of complete occlusions in all clips."""
    return float(len(_hidden_lengths(clips)))


def hidden_frames(clips: ClipSet) -> float:
    """Median number of frames that a complete occlusion hides all of the target."""
    return float(np.median(_hidden_lengths(clips)))


def feature_noise_ratio(clips: ClipSet, *, pairs: int) -> float:
    """Signal-to-noise of c1c2c3 over that of RGB in the median clip."""
    ratios = []
    for clip in clips.clips:
        frames = clips.frame_pairs(clip, pairs)
        rgb, invariants = np.median([_signal_to_noise(clip, f) for f in frames], axis=0)
        ratios.append(invariants / rgb)
    return float(np.median(ratios))


def target_saturation(clips: ClipSet, *, pairs: int) -> float:
    """Mean of (max - min) / max of the target's colours in the median clip."""
    values = []
    for clip in clips.clips:
        frames = clips.frame_pairs(clip, pairs)
        colours = [clip.target_colours(frame).astype(int) for frame in frames]
        extremes = [(c.max(axis=1), c.min(axis=1)) for c in colours]
        values.append(np.median([np.mean((hi - lo) / np.maximum(hi, 1)) for hi, lo in extremes]))
    return float(np.median(values))


def target_in_box(clips: ClipSet, *, pairs: int) -> float:
    """Share of the target's pixels inside its box, worst frame of all clips."""
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
    """Evenly spaced frames that show all of the target, as does the next frame."""
    whole = clip.visibility > 0.98
    frames = np.flatnonzero(whole[:-1] & whole[1:])
    return [int(frame) for frame in frames[np.linspace(0, len(frames) - 1, pairs).astype(int)]]


def _signal_to_noise(clip: SceneImages, frame: int) -> tuple[float, float]:
    """Variance over the target, relative to that of the change to the next frame: RGB, c1c2c3."""
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
    """Ratios c1, c2, c3 (equation 18) of BGR colours of shape (k, 3); black gives 0."""
    values = colours[:, ::-1].astype(float)
    others = [values[:, [j for j in range(3) if j != k]].max(axis=1) for k in range(3)]
    return np.asarray(values / np.maximum(np.stack(others, axis=1), 1.0))
