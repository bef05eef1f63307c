"""Static criteria of scenes: measured on images and ground truth, before any tracker runs.

A criterion is a function of a `SceneImages` that returns one number. `criteria.toml` of a paper
names the function, its options, the target and the sentence of the paper that asks for it.
"""

from functools import lru_cache
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

import datasets
from bench.papers.multipart import margins
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


# wang2010: the paper counts frames from 1, and so do the options of these functions


def upward_speed(scene: SceneImages, *, first: int, last: int) -> float:
    """Mean speed upwards with which the target comes to frames `first` to `last` [px/frame]."""
    rows = scene.centres[:, 1]
    return float((rows[first - 2] - rows[last - 1]) / (last - first + 1))


def velocity_changes(scene: SceneImages) -> NDArray[np.float64]:
    """Change of the velocity with which the target comes to each frame from 3 on [px/frame]."""
    changes = np.diff(scene.centres, n=2, axis=0)
    return np.asarray(np.hypot(changes[:, 0], changes[:, 1]))


def velocity_change(scene: SceneImages, *, frame: int) -> float:
    """Change of the target's velocity in one frame [px/frame]."""
    return float(velocity_changes(scene)[frame - 3])


def other_velocity_change(scene: SceneImages, *, frame: int) -> float:
    """Largest change of velocity in all other frames, as a share of that in `frame`."""
    changes = velocity_changes(scene)
    return float(np.delete(changes, frame - 3).max() / changes[frame - 3])


def brightness_contrast(scene: SceneImages) -> float:
    """Mean grey level of the target minus that of the rest, (R + G + B) / 3; median of frames."""
    differences = []
    for frame in range(len(scene)):
        grey, mask = scene.image(frame).mean(axis=2), scene.mask(frame)
        differences.append(grey[mask].mean() - grey[~mask].mean())
    return float(np.median(differences))


def motion_marks(scene: SceneImages, frame: int) -> NDArray[np.bool_]:
    """Pixels that the paper's motion map marks in a frame from 3 on (section 2.1.2)."""
    greys = [scene.image(frame - back).astype(int).sum(axis=2) for back in (1, 2, 3)]
    difference = sum(
        cv2.boxFilter(
            np.abs(later - earlier).astype(float),
            -1,
            (5, 5),
            normalize=False,
            borderType=cv2.BORDER_CONSTANT,
        )
        for later, earlier in pairwise(greys)
    )
    return np.asarray(difference > np.mean(difference) + 2 * np.std(difference))


def colour_weights(scene: SceneImages, frame: int) -> NDArray[np.float64]:
    """Colour map of a frame by hue and saturation of the first box (section 2.1.1)."""
    left, top = scene.boxes[0, :2].round().astype(int)
    right, bottom = (scene.boxes[0, :2] + scene.boxes[0, 2:]).round().astype(int)
    bins, box_bins = (
        cv2.cvtColor(image, cv2.COLOR_BGR2HSV_FULL)[..., :2].astype(int) // 8
        for image in (scene.image(frame - 1), scene.image(0)[top:bottom, left:right])
    )
    counts = [np.bincount(box_bins[..., k].ravel(), minlength=32) for k in (0, 1)]
    hue, saturation = (counts[k][bins[..., k]] / counts[k].max() for k in (0, 1))
    return np.asarray(0.7 * hue + 0.3 * saturation)


def motion_marked_share(scene: SceneImages) -> float:
    """Share of the target that the motion map marks, mean of the frames from 3 on."""
    shares = [
        motion_marks(scene, frame)[scene.mask(frame - 1)].mean()
        for frame in range(3, len(scene) + 1)
    ]
    return float(np.mean(shares))


def motion_map_on_target(scene: SceneImages, *, frame: int) -> float:
    """Share of the motion probability map, colour times motion, that lies on the target."""
    weights = colour_weights(scene, frame) * motion_marks(scene, frame)
    return float(weights[scene.mask(frame - 1)].sum() / weights.sum())


def surroundings_distance(scene: SceneImages, *, first: int, last: int) -> float:
    """Distance of the target's colours from those around it, median of frames."""
    return float(np.median([ring_distance(scene, k - 1) for k in range(first, last + 1)]))


def visible_deviation(scene: SceneImages, *, share: float, first: int, last: int) -> float:
    """Largest deviation of the visible share from `share` in frames `first` to `last`."""
    return float(np.abs(scene.visibility[first - 1 : last] - share).max())


# moreno2005


def model_auc(scene: SceneImages, *, frame: int, age: int) -> float:
    """Separability of target and ring in `frame` by colours that are `age` frames old."""
    return colour_auc(scene, frame, frame - age)


def auc_percentile(
    scene: SceneImages, *, percentile: float, first_model: bool = False, step: int = 5
) -> float:
    """Percentile over frames of the separability of target and ring.

    The colours are those of each frame itself, or, with `first_model`, of the first frame. Every
    `step`-th frame is measured.
    """
    frames = range(0, len(scene), step)
    values = [colour_auc(scene, frame, 0 if first_model else frame) for frame in frames]
    return float(np.percentile(values, percentile))


def hard_share(scene: SceneImages, *, limit: float, age: int) -> float:
    """Share of the frames with a separability <= `limit` by colours that are `age` frames old."""
    frames = range(age, len(scene))
    return float(np.mean([colour_auc(scene, frame, frame - age) <= limit for frame in frames]))


def channel_gain_ratio(scene: SceneImages, *, frame: int) -> float:
    """Largest over smallest gain of a channel of the target's mean colour since the last frame."""
    before, after = (scene.target_colours(f).mean(axis=0) for f in (frame - 1, frame))
    gains = after / np.maximum(before, 1.0)
    return float(gains.max() / gains.min())


def speed_at(scene: SceneImages, *, frame: int) -> float:
    """Displacement of the box's centre since the last frame in pixels."""
    return float(speeds(scene)[frame - 1])


def speed_percentile(scene: SceneImages, *, percentile: float) -> float:
    """Percentile of the speed of the box's centre in pixels per frame."""
    return float(np.nanpercentile(speeds(scene), percentile))


def colour_step(scene: SceneImages) -> float:
    """Median change of the target's mean colour per frame, RGB in [0, 1]."""
    means = np.array([scene.target_colours(f).mean(axis=0) for f in range(len(scene))]) / 255
    return float(np.median(np.linalg.norm(np.diff(means, axis=0), axis=1)))


def affine_overlap(scene: SceneImages, *, percentile: float, step: int = 10) -> float:
    """Percentile over frames of the overlap of the mask and an affine map of the first mask.

    The map gives the first mask the mean and covariance of the other; its rotation is the best
    of 72. The overlap is a lower bound of the best affine map's.
    """
    first = scene.mask(0)
    overlaps = [_moment_overlap(first, scene.mask(f)) for f in range(step, len(scene), step)]
    return float(np.percentile(overlaps, percentile))


def _moment_overlap(first: Mask, second: Mask, rotations: int = 72) -> float:
    """Best overlap of two masks over the affine maps that match mean and covariance."""
    means, roots = zip(*(_mask_moments(mask) for mask in (first, second)), strict=True)
    rows, columns = np.indices(second.shape)
    places = np.stack([columns.ravel(), rows.ravel()]) - means[1][:, None]
    near = (np.linalg.solve(roots[1], places) ** 2).sum(axis=0) < 16  # within 4 deviations
    white, inside = np.linalg.solve(roots[1], places[:, near]), second.ravel()[near]
    best = 0.0
    for angle in np.arange(rotations) * 2 * np.pi / rotations:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        x, y = np.round(roots[0] @ turn @ white + means[0][:, None]).astype(int)
        valid = (x >= 0) & (y >= 0) & (x < first.shape[1]) & (y < first.shape[0])
        mapped = np.zeros(len(x), np.bool_)
        mapped[valid] = first[y[valid], x[valid]]
        best = max(best, float((mapped & inside).sum() / (mapped | inside).sum()))
    return best


def _mask_moments(mask: Mask) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean (x, y) of a mask's pixels and the symmetric square root of their covariance."""
    rows, columns = np.nonzero(mask)
    places = np.stack([columns, rows]).astype(float)
    values, vectors = np.linalg.eigh(np.cov(places))
    return places.mean(axis=1), np.asarray(vectors * np.sqrt(values) @ vectors.T)


# multipart


def right_choice(scene: SceneImages, *, two_coloured: bool) -> float:
    """Share of jittered first rectangles for which Eq. 7 selects the right representation."""
    frame = scene.sequence.first_frame
    box = scene.sequence.regions["full"][frame]
    return margins.right_choice(scene.image(frame), box, two_coloured)


def low_margin_share(scene: SceneImages, *, parts: int, below: float, until: float = 1.0) -> float:
    """Share of the frames before a part of the sequence whose margin is below a limit."""
    frames, values = margins.margins(scene.sequence)
    return float((values[parts - 1][frames < until * len(scene)] < below).mean())


def low_margin_stretch(scene: SceneImages, *, parts: int, below: float) -> float:
    """Longest stretch of measured frames with a margin below a limit, in frames."""
    frames, values = margins.margins(scene.sequence)
    step = margins.sampled_frames(len(scene))[1]
    low = np.zeros(len(scene) // step + 1, bool)
    low[frames // step] = values[parts - 1] < below
    return float(max(longest_stretch(low) - 1, 0) * step + 1)


def crossing_time(scene: SceneImages, *, after: float) -> float:
    """Part of the sequence at which the target is hidden most, after a part of the sequence."""
    first = round(after * len(scene))
    return float((first + scene.visibility[first:].argmin()) / len(scene))


def crossing_margin(scene: SceneImages, *, after: float) -> float:
    """Smallest margin of the single histogram after a part of the sequence."""
    frames = tuple(range(round(after * len(scene)), len(scene), 2))
    return float(margins.margins(scene.sequence, frames)[1][0].min())


def background_in_person(scene: SceneImages) -> float:
    """Share of the whole person's rectangle in the first frame that does not show the target."""
    frame = scene.sequence.first_frame
    inside = box_mask(scene.mask(frame).shape, scene.sequence.regions["full"][frame])
    return float(1.0 - (scene.mask(frame) & inside).sum() / inside.sum())


# nummiaro2003


def occlusions(visibility: NDArray[np.float64], visible: float) -> list[tuple[int, int]]:
    """Stretches of frames (first, end) with less than `visible` of the target seen.

    The target is seen before and after each of them: entering and leaving the view do not count.
    """
    seen = np.flatnonzero(visibility >= visible)
    gaps = np.flatnonzero(np.diff(seen) > 1)
    return [(int(seen[gap]) + 1, int(seen[gap + 1])) for gap in gaps]


def tree_occlusion(visibility: NDArray[np.float64], visible: float) -> tuple[int, int]:
    """Longest of the `occlusions`, that by the tree: first frame and end."""
    return max(occlusions(visibility, visible), key=lambda stretch: stretch[1] - stretch[0])


def frame_after_tree(visibility: NDArray[np.float64]) -> int:
    """First frame after the longest occlusion in which the target is wholly visible (>= 0.99).

    A tracker that starts there meets the short occlusions only: `sequence[frame:]`.
    """
    _, end = tree_occlusion(visibility, 0.5)
    return end + int(np.argmax(visibility[end:] >= 0.99))


def short_occlusions(scene: SceneImages) -> list[tuple[int, int]]:
    """Occlusions after the tree's with less than half of the target seen."""
    start = frame_after_tree(scene.visibility)
    return [stretch for stretch in occlusions(scene.visibility, 0.5) if stretch[0] > start]


def tree_frames(scene: SceneImages, *, visible: float) -> float:
    """Frames in which less than `visible` of the target is seen at the tree."""
    start, end = tree_occlusion(scene.visibility, visible)
    return float(end - start)


def least_visible_at_tree(scene: SceneImages) -> float:
    """Smallest visible share of the target at the tree."""
    start, end = tree_occlusion(scene.visibility, 0.5)
    return float(scene.visibility[start:end].min())


def number_of_short_occlusions(scene: SceneImages) -> float:
    """Number of occlusions after the tree's with less than half of the target seen."""
    return float(len(short_occlusions(scene)))


def longest_short_occlusion(scene: SceneImages) -> float:
    """Frames of the longest occlusion after the tree's, with less than half seen."""
    return float(max((end - start for start, end in short_occlusions(scene)), default=0))


def frames_before_short_occlusions(scene: SceneImages) -> float:
    """Frames from `frame_after_tree` to the first short occlusion."""
    first = min((start for start, _ in short_occlusions(scene)), default=0)
    return float(first - frame_after_tree(scene.visibility))


def hider_distance(scene: SceneImages, stretch: tuple[int, int]) -> float:
    """Bhattacharyya distance of the target's colours and of what hides it in a stretch.

    What hides it are the pixels in the middle half of the box, in the frame of least visibility,
    that do not show the target. The target's colours are those of its first frame.
    """
    frame = stretch[0] + int(np.argmin(scene.visibility[stretch[0] : stretch[1]]))
    middle = box_mask(scene.mask(frame).shape, scene.boxes[frame], 0.5)
    hider = scene.image(frame)[middle & ~scene.mask(frame)]
    target = scene.target_colours(scene.sequence.first_frame)
    return bhattacharyya(colour_histogram(target), colour_histogram(hider))


def distance_of_students(scene: SceneImages) -> float:
    """Smaller distance of the target's colours and a hiding student's clothes."""
    return min((hider_distance(scene, stretch) for stretch in short_occlusions(scene)), default=0.0)


def distance_of_tree(scene: SceneImages) -> float:
    """Distance of the target's colours and those of the tree that hides it."""
    return hider_distance(scene, tree_occlusion(scene.visibility, 0.5))


def changed_share(scene: SceneImages, *, distance: float, step: int = 5) -> float:
    """Share of the frames with a target histogram at least `distance` from the first frame's."""
    first = colour_histogram(scene.target_colours(scene.sequence.first_frame))
    changes = [
        bhattacharyya(first, colour_histogram(scene.target_colours(frame)))
        for frame in range(scene.sequence.first_frame, len(scene), step)
    ]
    return float(np.mean(np.array(changes) >= distance))


def attribute_share(scene: SceneImages, *, attribute: str) -> float:
    """Share of the frames that have an attribute."""
    return float(scene.sequence.attributes[attribute].mean())


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
