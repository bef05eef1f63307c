"""Golden digests of a sequence: what it shows and what is true of it, at a few frames."""

import hashlib

import numpy as np

from trackmark.datasets.interface import Image, Sequence

TILES = 4  # tiles across and down of which a look keeps the mean colours


def golden_digests(sequence: Sequence) -> dict[str, str]:
    """Digests of images and masks, and of the truth.

    Returns `images` over bytes of images and masks at the beginning, in the middle and at the end;
    `truth` over boxes, visibility and regions of all frames, to a millionth of a pixel; `look`, the
    mean colours of tiles of these images in hexadecimal: they tell a changed picture from a changed
    last bit, as another platform's arithmetic may give.
    """
    n = len(sequence)
    # Of 120 frames, those in which the knobs of `plain/target` show.
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


def look_difference(one: str, other: str) -> int:
    """Greatest difference between two looks, in grey levels; 255 for other sizes."""
    a, b = (np.frombuffer(bytes.fromhex(look), np.uint8).astype(int) for look in (one, other))
    return int(np.abs(a - b).max()) if len(a) == len(b) else 255


def _look(image: Image) -> bytes:
    height, width = (side // TILES for side in image.shape[:2])
    tiles = image[: TILES * height, : TILES * width].reshape(TILES, height, TILES, width, 3)
    return bytes(tiles.mean(axis=(1, 3)).round().astype(np.uint8))
