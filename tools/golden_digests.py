"""Golden digests of a sequence: reference values of its images and its ground truth."""

import hashlib

import numpy as np

from trackmark.datasets.interface import Image, Sequence

N_TILES = 4  # number of tiles in each direction whose mean colours are stored


def golden_digests(sequence: Sequence) -> dict[str, str]:
    """Return digests of images, masks and ground truth by name.

    `images` covers the bytes of images and masks at the start, in the middle and at the end.
    `truth` covers boxes, visibility and regions of all frames, rounded to 1e-6. `look` contains the
    mean colours of tiles of these images in hexadecimal. It distinguishes a different image from a
    rounding difference, which the arithmetic of another platform can cause.
    """
    n = len(sequence)
    # Frames of `plain/target`, which has 120, in which every parameter has a visible effect.
    frames = (0, 41, 60, 119) if n == 120 else (0, n // 2, n - 1)
    images, looks = hashlib.sha256(), []
    for frame in frames:
        image, mask = sequence[frame], sequence.mask(frame)
        images.update(image.tobytes() + (b"" if mask is None else mask.tobytes()))
        looks.append(_look(image))
    columns = [sequence.boxes, sequence.visibility, *sequence.regions.values()]
    truth = np.column_stack(columns).round(6) + 0.0
    return {
        "images": images.hexdigest()[:32],
        "truth": hashlib.sha256(truth.tobytes()).hexdigest()[:32],
        "look": b"".join(looks).hex(),
    }


def look_difference(first: str, second: str) -> int:
    """Return the maximum difference of two `look` digests [grey levels]; 255 if sizes differ."""
    a, b = (np.frombuffer(bytes.fromhex(look), np.uint8).astype(int) for look in (first, second))
    return int(np.abs(a - b).max()) if len(a) == len(b) else 255


def _look(image: Image) -> bytes:
    """Return the rounded mean colours of an image's tiles."""
    height, width = (side // N_TILES for side in image.shape[:2])
    tiles = image[: N_TILES * height, : N_TILES * width].reshape(N_TILES, height, N_TILES, width, 3)
    return bytes(tiles.mean(axis=(1, 3)).round().astype(np.uint8))
