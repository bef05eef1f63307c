"""Filters of place: where the target is, how large, what is before it, what is told of it."""

from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.decoding import check_pixels
from trackmark.datasets.filters.timing import changed, generator
from trackmark.datasets.interface import Image, Mask, Sequence, SequenceError, lies_outside

Array = NDArray[np.float64]

AFTER_WALL = 15  # frames that must follow an occlusion: a target counts as lost after ten
WALL_MARGIN = 0.1  # how far a wall goes beyond what it hides, in sizes of the first box
ROOM = 1.5  # radius of the disk that a walk keeps to, in widths of the first box
CLIMB = 0.1  # of what passes over the target, against it [target heights/frame]


def size(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Resize images, truth and masks."""
    _, _, box_width, box_height = _first_box(sequence)
    width, height = sequence.image_size
    ratio = value / np.sqrt(box_width * box_height)
    target = max(1, round(width * ratio)), max(1, round(height * ratio))
    try:
        check_pixels(*target)
    except ValueError as error:
        raise SequenceError(f"{sequence.name}: filter.size={value:g}: {error}.") from None
    way = cv2.INTER_AREA if ratio < 1 else cv2.INTER_LINEAR

    def mask(frame: int) -> Mask | None:
        whole = sequence.mask(frame)
        if whole is None:
            return None
        return np.asarray(cv2.resize(whole.astype(np.uint8), target, interpolation=way) > 0)

    return changed(
        sequence,
        lambda frame: np.asarray(cv2.resize(sequence[frame], target, interpolation=way)),
        masks=mask,
        image_size=target,
        **_truth(sequence, np.tile(np.divide(target, (width, height)), 2), np.zeros(4)),
    )


def motion(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Walk at random, by steps of one length, within a disk about where it was."""
    # Whole pixels, so that nothing is blurred.
    offsets = np.rint(_walk(sequence, value * _first_box(sequence)[2], draw))

    def mask(frame: int) -> Mask | None:
        whole = sequence.mask(frame)
        if whole is None:
            return None
        moved = _moved(whole.astype(np.uint8), offsets[frame], cv2.BORDER_CONSTANT)
        return moved.astype(np.bool_)

    width, height = sequence.image_size
    truth = _truth(sequence, np.ones(4), np.pad(offsets, ((0, 0), (0, 2))))
    x, y, box_width, box_height = truth["boxes"].T
    gone = (x >= width) | (y >= height) | (x + box_width <= 0) | (y + box_height <= 0)
    truth["boxes"][gone] = np.nan
    return changed(
        sequence,
        lambda frame: _moved(sequence[frame], offsets[frame], cv2.BORDER_REPLICATE),
        masks=mask,
        **truth,
    )


def _walk(sequence: Sequence, length: float, draw: int) -> Array:
    """Offsets (x, y) by frame, shape (n, 2): nothing until the first box, then a step a frame.

    The target's middle stays in the image, where it was in it.
    """
    width = _first_box(sequence)[2]
    random = generator(draw, 1)
    middles = sequence.boxes[:, :2] + sequence.boxes[:, 2:] / 2
    offsets = np.zeros((len(sequence), 2))
    for frame in range(sequence.first_frame + 1, len(sequence)):
        angles = random.uniform(0, 2 * np.pi, 64)
        tried = offsets[frame - 1] + length * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        places = tried + middles[frame]
        outside = (places < 0) | (places > sequence.image_size)  # of an absent target none is
        far = np.hypot(*tried.T)
        fault = outside.any(axis=1) * 1e6 + np.where(far > max(ROOM * width, length), far, 0.0)
        offsets[frame] = tried[np.argmin(fault)]
    return offsets


def occlusion(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Put a wall where the target will be; the truth goes on behind it."""
    first, n = sequence.first_frame, len(sequence)
    begins = first + max(1, (n - first) // 6)
    hidden = np.arange(begins, begins + int(value))
    if begins + int(value) + AFTER_WALL > n:
        raise SequenceError(
            f"{sequence.name}: filter.occlusion={value:g} is too long for it: at most "
            f"{max(0, n - AFTER_WALL - begins)} of its {n} frames leave {AFTER_WALL} after them."
        )
    rows = sequence.boxes[hidden][sequence.present[hidden]]
    if len(rows) == 0:
        return changed(sequence)
    margin = WALL_MARGIN * _first_box(sequence)[2:]
    left, top = np.floor(np.maximum(rows[:, :2].min(axis=0) - margin, 0)).astype(int)
    right, bottom = np.ceil((rows[:, :2] + rows[:, 2:]).max(axis=0) + margin).astype(int)
    colour = cache(lambda: _mean_colour(sequence))

    def image(frame: int) -> Image:
        shown = sequence[frame].copy()
        if begins <= frame < begins + int(value):
            shown[top : max(0, bottom), left : max(0, right)] = colour()
        return shown

    def mask(frame: int) -> Mask | None:
        whole = sequence.mask(frame)
        if whole is None or not begins <= frame < begins + int(value):
            return whole
        return np.zeros_like(whole)

    visibility, flags = sequence.visibility.copy(), np.zeros(n, np.bool_)
    visibility[hidden], flags[hidden] = 0.0, True
    flags |= sequence.attributes.get("occlusion", False)
    return changed(
        sequence,
        image,
        masks=mask,
        visibility=visibility,
        attributes={**sequence.attributes, "occlusion": flags},
    )


def similarity(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Have something rise past the target, half a width beside its middle."""
    first = sequence.first_frame
    middle = first + (len(sequence) - first) / 2
    side = 0.5 if generator(draw, 2).random() < 0.5 else -0.5
    patch = cache(lambda: _other(sequence, value))

    def image(frame: int) -> Image:
        shown = sequence[frame].copy()
        box = sequence.boxes[frame]
        climbed = CLIMB * (frame - middle)
        if frame > first and abs(climbed) <= 3 and np.isfinite(box).all():
            size = np.array(patch().shape[1::-1])
            corner = box[:2] + box[2:] / 2 + size * (side - 0.5, -climbed - 0.5)
            _paste(shown, patch(), np.rint(corner).astype(int))
        return shown

    return changed(sequence, image)


def box_error(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Shift the boxes that trackers begin with, and the mask; truth that is scored stays."""
    first = sequence.first_frame
    box = _first_box(sequence)
    angle = generator(draw, 3).uniform(0, 2 * np.pi)
    shift = value * box[2:] * (np.cos(angle), np.sin(angle))
    if lies_outside(box + [*shift, 0, 0], sequence.image_size):
        shift = -shift
    rows = np.zeros((len(sequence), 4))
    rows[first, :2] = shift

    def mask(frame: int) -> Mask | None:
        whole = sequence.mask(frame)
        if whole is None or frame != first:
            return whole
        moved = _moved(whole.astype(np.uint8), np.rint(shift), cv2.BORDER_CONSTANT)
        return moved.astype(np.bool_)

    return changed(sequence, masks=mask, **_truth(sequence, np.ones(4), rows))


def _first_box(sequence: Sequence) -> Array:
    sequence.check_runnable()
    return np.asarray(sequence.boxes[sequence.first_frame])


def _truth(sequence: Sequence, scale: Array, shift: Array) -> dict[str, Any]:
    """Boxes and regions, scaled and then shifted: (4,), or (n, 4) a frame."""
    regions = {name: rows * scale + shift for name, rows in sequence.regions.items()}
    return {"boxes": sequence.boxes * scale + shift, "regions": regions}


def _moved(image: NDArray[np.uint8], offset: Array, border: int) -> Image:
    """An image shifted by whole pixels; at the border it goes on, or is empty."""
    height, width = image.shape[:2]
    matrix = np.array([[1.0, 0.0, offset[0]], [0.0, 1.0, offset[1]]])
    way = cv2.INTER_NEAREST
    return np.asarray(
        cv2.warpAffine(image, matrix, (width, height), flags=way, borderMode=border), np.uint8
    )


def _mean_colour(sequence: Sequence) -> NDArray[np.uint8]:
    """Mean colour of the first image that is tracked in."""
    mean = sequence[sequence.first_frame].mean(axis=(0, 1))
    return np.asarray(np.rint(mean), np.uint8)


def _other(sequence: Sequence, value: float) -> NDArray[np.uint8]:
    """What passes: the first box's picture, mixed with its image's mean colour."""
    x, y, width, height = np.rint(_first_box(sequence)).astype(int).tolist()
    image = sequence[sequence.first_frame]
    cut = image[max(0, y) : max(1, y + height), max(0, x) : max(1, x + width)]
    mixed = value * cut + (1 - value) * _mean_colour(sequence)
    return np.asarray(np.rint(mixed), np.uint8)


def _paste(image: Image, patch: NDArray[np.uint8], corner: NDArray[np.int64]) -> None:
    """Draw the ellipse within a patch, its corner (x, y) there; what is outside is not drawn."""
    height, width = patch.shape[:2]
    y, x = np.mgrid[:height, :width] + 0.5
    inside = (x / width - 0.5) ** 2 + (y / height - 0.5) ** 2 <= 0.25
    low = np.maximum(corner, 0)
    high = np.minimum(corner + (width, height), image.shape[1::-1])
    if (high <= low).any():
        return
    to = np.s_[low[1] : high[1], low[0] : high[0]]
    of = np.s_[low[1] - corner[1] : high[1] - corner[1], low[0] - corner[0] : high[0] - corner[0]]
    image[to] = np.where(inside[of][..., None], patch[of], image[to])
