"""Images and ground truth of a scene, and criteria of several papers.

The ring of a target is its surroundings: the box, enlarged about its centre, without the target.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.datasets.interface import Image, Mask

CACHED_FRAMES = 512


class SceneImages:
    """Images and ground truth of one scene. Images and masks are rendered once.

    `boxes`: `[x, y, width, height]` in pixels, shape (n, 4); NaN rows if the target is out of view.
    `visibility`: visible share of the target in [0, 1], shape (n,).
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
        """Return the colours of the target's visible pixels, shape (k, 3)."""
        return np.asarray(self.image(frame)[self.mask(frame)])

    def ring_colours(self, frame: int, scale: float = 2.0) -> NDArray[np.uint8]:
        """Return the colours in the box enlarged by `scale`, without the target, shape (k, 3)."""
        around = box_mask(self.mask(frame).shape, self.boxes[frame], scale)
        return np.asarray(self.image(frame)[around & ~self.mask(frame)])


def box_mask(
    shape: tuple[int, ...], box: NDArray[np.float64], scale: float = 1.0
) -> NDArray[np.bool_]:
    """Return the pixels inside a box that is enlarged about its centre by `scale`."""
    height, width = shape[:2]
    x, y, box_width, box_height = box
    rows, columns = np.mgrid[:height, :width]
    inside_x = np.abs(columns + 0.5 - x - box_width / 2) <= box_width * scale / 2
    return np.asarray(
        inside_x & (np.abs(rows + 0.5 - y - box_height / 2) <= box_height * scale / 2)
    )


def colour_histogram(colours: NDArray[np.uint8], bins: int = 8) -> NDArray[np.float64]:
    """Return the normalised RGB histogram of colours of shape (k, 3), with `bins`³ bins."""
    cells = colours.astype(int) * bins // 256
    index = (cells[:, 0] * bins + cells[:, 1]) * bins + cells[:, 2]
    counts = np.bincount(index, minlength=bins**3).astype(float)
    return np.asarray(counts / max(counts.sum(), 1.0))


def bhattacharyya(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return the Bhattacharyya distance between two normalised histograms, in [0, 1]."""
    return float(np.sqrt(max(0.0, 1.0 - np.sqrt(first * second).sum())))


def auc(scores: NDArray[np.float64], is_target: NDArray[np.bool_]) -> float:
    """Return the area under the ROC curve of scores that separate the target from other pixels."""
    _, inverse, counts = np.unique(scores, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - (counts - 1) / 2)[inverse]
    n_target = int(is_target.sum())
    n_rest = len(is_target) - n_target
    return float((ranks[is_target].sum() - n_target * (n_target + 1) / 2) / (n_target * n_rest))


def colour_model(
    colours: NDArray[np.uint8], bins: int = 12, floor: float = 0.05
) -> NDArray[np.float64]:
    """Return the logarithm of a smoothed RGB histogram with `bins`³ bins."""
    counts = colour_histogram(colours, bins) * len(colours) + floor
    return np.asarray(np.log(counts / counts.sum()))


def colour_auc(scene: SceneImages, frame: int, model_frame: int, scale: float = 2.2) -> float:
    """Return the AUC of target against ring in `frame`, by the colours of `model_frame`."""
    ratio = colour_model(scene.target_colours(model_frame)) - colour_model(
        scene.ring_colours(model_frame, scale)
    )
    target, ring = scene.target_colours(frame), scene.ring_colours(frame, scale)
    colours = np.concatenate([target, ring]).astype(int) * 12 // 256
    scores = ratio[(colours[:, 0] * 12 + colours[:, 1]) * 12 + colours[:, 2]]
    return auc(scores, np.arange(len(colours)) < len(target))


def speeds(scene: SceneImages) -> NDArray[np.float64]:
    """Return the displacement of the box centre between frames [px], shape (n - 1,)."""
    steps = np.diff(scene.centres, axis=0)
    return np.asarray(np.hypot(steps[:, 0], steps[:, 1]))


def slow_share(scene: SceneImages, *, limit: float) -> float:
    """Return the share of frames in which the target moves by less than `limit` pixels."""
    return float(np.nanmean(speeds(scene) < limit))


def median_speed(scene: SceneImages) -> float:
    """Return the median speed [px/frame]."""
    return float(np.nanmedian(speeds(scene)))


def relative_speed(scene: SceneImages, *, percentile: float) -> float:
    """Return a percentile of the speed [mean box sides per frame]."""
    return float(np.nanpercentile(speeds(scene) / scene.sides[:-1], percentile))


def area_ratio(scene: SceneImages) -> float:
    """Return the ratio of the largest to the smallest area of the boxes."""
    areas = scene.boxes[:, 2] * scene.boxes[:, 3]
    return float(np.nanmax(areas) / np.nanmin(areas))


def background_in_first_box(scene: SceneImages) -> float:
    """Return the share of the first box that does not show the target."""
    frame = scene.sequence.first_frame
    inside = box_mask(scene.mask(frame).shape, scene.boxes[frame])
    return float(1.0 - (scene.mask(frame) & inside).sum() / inside.sum())


def ring_distance(scene: SceneImages, frame: int) -> float:
    """Return the Bhattacharyya distance between the colours of target and ring."""
    return bhattacharyya(
        colour_histogram(scene.target_colours(frame)), colour_histogram(scene.ring_colours(frame))
    )


def longest_stretch(flags: NDArray[np.bool_]) -> int:
    """Return the length of the longest run of true values [frames]."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False]))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def longest_hidden(scene: SceneImages, *, visible: float) -> float:
    """Return the longest run of frames with less than `visible` of the target visible."""
    return float(longest_stretch(scene.visibility < visible))
