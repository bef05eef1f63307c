"""Filters of position, size, occlusion, similar objects and init box."""

from collections.abc import Callable
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.decoding import check_pixels
from trackmark.datasets.filters.timing import generator, with_changes
from trackmark.datasets.interface import Image, Mask, Sequence, SequenceError, lies_outside

Array = NDArray[np.float64]

MIN_FRAMES_AFTER_WALL = 15  # more than the ten frames of failure that count as a lost target
WALL_MARGIN = 0.1  # margin of a wall around the occluded boxes [sizes of the first box]
MAX_WALK_RADIUS = 1.5  # maximum distance of a random walk from its start [widths of the first box]
CLIMB = 0.1  # speed of the similar object relative to the target [target heights/frame]


def size(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Resize images, boxes and masks so that the first box has the size `value`."""
    _, _, box_width, box_height = _first_box(sequence)
    width, height = sequence.image_size
    ratio = value / np.sqrt(box_width * box_height)
    new_size = max(1, round(width * ratio)), max(1, round(height * ratio))
    try:
        check_pixels(*new_size)
    except ValueError as error:
        raise SequenceError(f"{sequence.name}: filter.size={value:g}: {error}.") from None
    method = cv2.INTER_AREA if ratio < 1 else cv2.INTER_LINEAR
    return with_changes(
        sequence,
        lambda frame: np.asarray(cv2.resize(sequence[frame], new_size, interpolation=method)),
        masks=_map_masks(
            sequence,
            lambda mask, _: cv2.resize(mask.astype(np.uint8), new_size, interpolation=method),
        ),
        image_size=new_size,
        **_map_boxes(sequence, np.tile(np.divide(new_size, (width, height)), 2), np.zeros(4)),
    )


def motion(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Shift the images along a random walk of constant step length within a disk."""
    # Shifts by whole pixels do not blur the images.
    offsets = np.rint(_walk(sequence, value * _first_box(sequence)[2], draw))
    width, height = sequence.image_size
    truth = _map_boxes(sequence, np.ones(4), np.pad(offsets, ((0, 0), (0, 2))))
    x, y, box_width, box_height = truth["boxes"].T
    is_outside = (x >= width) | (y >= height) | (x + box_width <= 0) | (y + box_height <= 0)
    truth["boxes"][is_outside] = np.nan
    return with_changes(
        sequence,
        lambda frame: _shifted(sequence[frame], offsets[frame], cv2.BORDER_REPLICATE),
        masks=_map_masks(
            sequence,
            lambda mask, frame: _shifted(
                mask.astype(np.uint8), offsets[frame], cv2.BORDER_CONSTANT
            ),
        ),
        **truth,
    )


def _walk(sequence: Sequence, length: float, draw: int) -> Array:
    """Return the offset (x, y) of each frame, shape (n, 2); it is 0 up to the first box.

    The target's centre stays inside the image if it is inside without the offset.
    """
    width = _first_box(sequence)[2]
    random = generator(draw, 1)
    centres = sequence.boxes[:, :2] + sequence.boxes[:, 2:] / 2
    offsets = np.zeros((len(sequence), 2))
    for frame in range(sequence.first_frame + 1, len(sequence)):
        angles = random.uniform(0, 2 * np.pi, 64)
        candidates = offsets[frame - 1] + length * np.stack(
            [np.cos(angles), np.sin(angles)], axis=1
        )
        positions = candidates + centres[frame]
        # NaN positions of an absent target count as inside.
        outside = (positions < 0) | (positions > sequence.image_size)
        distances = np.hypot(*candidates.T)
        too_far = np.where(distances > max(MAX_WALK_RADIUS * width, length), distances, 0.0)
        offsets[frame] = candidates[np.argmin(outside.any(axis=1) * 1e6 + too_far)]
    return offsets


def occlusion(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Cover the target with a wall for some frames; boxes do not change, the visibility is 0."""
    first, n = sequence.first_frame, len(sequence)
    start = first + max(1, (n - first) // 6)
    hidden = np.arange(start, start + int(value))
    if start + int(value) + MIN_FRAMES_AFTER_WALL > n:
        raise SequenceError(
            f"{sequence.name}: filter.occlusion={value:g} is too long for {n} frames. Use at most "
            f"{max(0, n - MIN_FRAMES_AFTER_WALL - start)}: {MIN_FRAMES_AFTER_WALL} frames must "
            "follow the wall."
        )
    rows = sequence.boxes[hidden][sequence.present[hidden]]
    if len(rows) == 0:
        return with_changes(sequence)
    margin = WALL_MARGIN * _first_box(sequence)[2:]
    left, top = np.floor(np.maximum(rows[:, :2].min(axis=0) - margin, 0)).astype(int)
    right, bottom = np.ceil((rows[:, :2] + rows[:, 2:]).max(axis=0) + margin).astype(int)
    colour = cache(lambda: _mean_colour(sequence))

    def image(frame: int) -> Image:
        pixels = sequence[frame].copy()
        if frame in hidden:
            pixels[top : max(0, bottom), left : max(0, right)] = colour()
        return pixels

    visibility, flags = sequence.visibility.copy(), np.zeros(n, np.bool_)
    visibility[hidden], flags[hidden] = 0.0, True
    flags |= sequence.attributes.get("occlusion", False)
    return with_changes(
        sequence,
        image,
        masks=_map_masks(
            sequence, lambda mask, frame: np.zeros_like(mask) if frame in hidden else mask
        ),
        visibility=visibility,
        attributes={**sequence.attributes, "occlusion": flags},
    )


def similarity(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Move a similar object upwards past the target, half a target width to one side."""
    first = sequence.first_frame
    middle = first + (len(sequence) - first) / 2
    side = 0.5 if generator(draw, 2).random() < 0.5 else -0.5
    patch = cache(lambda: _similar_patch(sequence, value))

    def image(frame: int) -> Image:
        pixels = sequence[frame].copy()
        box = sequence.boxes[frame]
        height = CLIMB * (frame - middle)
        if frame > first and abs(height) <= 3 and np.isfinite(box).all():
            size = np.array(patch().shape[1::-1])
            corner = box[:2] + box[2:] / 2 + size * (side - 0.5, -height - 0.5)
            _draw_ellipse(pixels, patch(), np.rint(corner).astype(int))
        return pixels

    return with_changes(sequence, image)


def box_error(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Shift the init box and its mask; the ground truth of later frames does not change."""
    first = sequence.first_frame
    box = _first_box(sequence)
    angle = generator(draw, 3).uniform(0, 2 * np.pi)
    shift = value * box[2:] * (np.cos(angle), np.sin(angle))
    if lies_outside(box + [*shift, 0, 0], sequence.image_size):
        shift = -shift
    rows = np.zeros((len(sequence), 4))
    rows[first, :2] = shift

    def shift_first(mask: Mask, frame: int) -> NDArray[Any]:
        if frame != first:
            return mask
        return _shifted(mask.astype(np.uint8), np.rint(shift), cv2.BORDER_CONSTANT)

    masks = _map_masks(sequence, shift_first)
    return with_changes(sequence, masks=masks, **_map_boxes(sequence, np.ones(4), rows))


def _first_box(sequence: Sequence) -> Array:
    sequence.check_runnable()
    return np.asarray(sequence.boxes[sequence.first_frame])


def _map_boxes(sequence: Sequence, scale: Array, shift: Array) -> dict[str, Any]:
    """Return boxes and regions, scaled and then shifted by values of shape (4,) or (n, 4)."""
    regions = {name: rows * scale + shift for name, rows in sequence.regions.items()}
    return {"boxes": sequence.boxes * scale + shift, "regions": regions}


def _map_masks(
    sequence: Sequence, change: Callable[[Mask, int], NDArray[Any]]
) -> Callable[[int], Mask | None]:
    """Return a function that returns the changed mask of a frame; None without a mask."""

    def mask(frame: int) -> Mask | None:
        original = sequence.mask(frame)
        return None if original is None else np.asarray(change(original, frame), np.bool_)

    return mask


def _shifted(image: NDArray[np.uint8], offset: Array, border: int) -> Image:
    """Return an image shifted by whole pixels, with a border mode of OpenCV."""
    height, width = image.shape[:2]
    matrix = np.array([[1.0, 0.0, offset[0]], [0.0, 1.0, offset[1]]])
    method = cv2.INTER_NEAREST
    return np.asarray(
        cv2.warpAffine(image, matrix, (width, height), flags=method, borderMode=border), np.uint8
    )


def _mean_colour(sequence: Sequence) -> NDArray[np.uint8]:
    """Return the mean colour of the first image with the target."""
    mean = sequence[sequence.first_frame].mean(axis=(0, 1))
    return np.asarray(np.rint(mean), np.uint8)


def _similar_patch(sequence: Sequence, value: float) -> NDArray[np.uint8]:
    """Return the pixels of the first box, mixed with the mean colour of the first image."""
    x, y, width, height = np.rint(_first_box(sequence)).astype(int).tolist()
    image = sequence[sequence.first_frame]
    pixels = image[max(0, y) : max(1, y + height), max(0, x) : max(1, x + width)]
    mixed = value * pixels + (1 - value) * _mean_colour(sequence)
    return np.asarray(np.rint(mixed), np.uint8)


def _draw_ellipse(image: Image, patch: NDArray[np.uint8], corner: NDArray[np.int64]) -> None:
    """Draw the pixels of a patch in its inscribed ellipse; `corner` is its upper left corner."""
    height, width = patch.shape[:2]
    y, x = np.mgrid[:height, :width] + 0.5
    inside = (x / width - 0.5) ** 2 + (y / height - 0.5) ** 2 <= 0.25
    low = np.maximum(corner, 0)
    high = np.minimum(corner + (width, height), image.shape[1::-1])
    if (high <= low).any():
        return
    target = np.s_[low[1] : high[1], low[0] : high[0]]
    left, top, right, bottom = *(low - corner), *(high - corner)
    source = np.s_[top:bottom, left:right]
    image[target] = np.where(inside[source][..., None], patch[source], image[target])
