"""Check that no two images of a folder have equal frame numbers in their names.

Ground truth is assigned to the images of a folder in the order of their names. A copy of an image
(`0003 (1).png`), or the same frame in another format, would shift it by one frame.
"""

from collections import Counter
from collections.abc import Sequence as SequenceOf
from pathlib import Path

from trackmark.datasets.interface import SequenceError
from trackmark.datasets.spec_string import natural_order

_Number = tuple[str | int, ...]  # name of an image up to its last number: text and numbers in turn


def check_frame_numbers(images: SequenceOf[Path]) -> None:
    """Refuse two images of one folder that have the same frame number.

    Two names collide if they are equal up to the last number (`0003.jpg` and `0003 copy.png`), or
    if one name extends the other (`0003 (1).png`, `Copy of 0003.png`). Text in front of a number
    does not indicate a copy if many images have it: it is the prefix of a second series
    (`depth0003.png`).

    Raises `SequenceError` naming both images.
    """
    numbers: dict[_Number, Path] = {}
    for image in images:
        if number := _frame_number(image):
            if number in numbers:
                raise _collision(image, numbers[number])
            numbers[number] = image
    prefixes = Counter(number[0] for number in numbers)
    for number, image in numbers.items():
        prefix, *rest = number
        begins = (number[:end] for end in range(2, len(number), 2))
        ends = (
            (shorter, *rest)
            for start in range(1, len(str(prefix)) + 1)
            if 2 * prefixes[prefix] < prefixes[shorter := str(prefix)[start:]]
        )
        for other in (*begins, *ends):
            if other in numbers:
                raise _collision(image, numbers[other])


def _frame_number(image: Path) -> _Number:
    """Return the name up to its last number, empty if it has no number."""
    parts, _ = natural_order(image.stem.casefold())
    return tuple(parts[:-1])


def _collision(*images: Path) -> SequenceError:
    """Return the error for two images; the image with the longer name is the likely copy."""
    original, copy = sorted(images, key=lambda image: (len(image.name), image.name))
    return SequenceError(
        f"{copy}: the image has the same frame number as {original.name}, which would shift the "
        "ground truth of all later frames. Expected is one image per frame. Remove one of the two, "
        "or move it to another folder."
    )
