"""Strict decoding of image files, and checks of their names.

Damaged data raise an error. Ground truth is assigned to the images of a folder in the order of
their names. A copy of an image (`0003 (1).png`), or the same frame in another format, would shift
the ground truth by one frame.
"""

import stat
from collections import Counter, abc
from collections.abc import Callable, Mapping
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import simplejpeg
from PIL.BmpImagePlugin import BmpImageFile
from PIL.ImageFile import ImageFile
from PIL.PngImagePlugin import PngImageFile
from PIL.PpmImagePlugin import PpmImageFile
from PIL.TiffImagePlugin import TiffImageFile

from trackmark.datasets.decoding import (
    PIXEL_LIMIT_VARIABLE,
    PROGRAMMING_ERRORS,
    check_name,
    check_pixels,
    decoding,
    pixel_limit,
)
from trackmark.datasets.interface import Image, SequenceError
from trackmark.datasets.spec_string import natural_order

# name of an image up to its last number: text and numbers in turn
_NumberedStem = tuple[str | int, ...]


def check_frame_numbers(images: abc.Sequence[Path]) -> None:
    """Refuse two images of one folder that have the same frame number.

    Two names collide if they are equal up to the last number (`0003.jpg` and `0003 copy.png`), or
    if one name extends the other (`0003 (1).png`, `Copy of 0003.png`). Text in front of a number
    does not indicate a copy if many images have it: it is the prefix of a second series
    (`depth0003.png`).

    Raises `SequenceError` naming both images.
    """
    images_by_stem: dict[_NumberedStem, Path] = {}
    for image in images:
        if stem := _numbered_stem(image):
            if stem in images_by_stem:
                raise _collision(image, images_by_stem[stem])
            images_by_stem[stem] = image
    prefixes = Counter(stem[0] for stem in images_by_stem)
    for stem, image in images_by_stem.items():
        prefix, *rest = stem
        begins = (stem[:end] for end in range(2, len(stem), 2))
        ends = (
            (shorter, *rest)
            for start in range(1, len(str(prefix)) + 1)
            if 2 * prefixes[prefix] < prefixes[shorter := str(prefix)[start:]]
        )
        for other in (*begins, *ends):
            if other in images_by_stem:
                raise _collision(image, images_by_stem[other])


def _numbered_stem(image: Path) -> _NumberedStem:
    """Return the name up to its last number; empty if the name contains no number."""
    stem_parts, _ = natural_order(image.stem.casefold())
    return tuple(stem_parts[:-1])


def _collision(*images: Path) -> SequenceError:
    """Return the error for two images; the image with the longer name is the likely copy."""
    original, copy = sorted(images, key=lambda image: (len(image.name), image.name))
    return SequenceError(
        f"{copy}: the image has the same frame number as {original.name}, which would shift the "
        "ground truth of all later frames. Expected: one image per frame. Remove one of the two, "
        "or move it to another folder."
    )


SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".ppm", ".tif", ".tiff")

_JPEG_START, _PNG_START, _TIFF_STARTS = b"\xff\xd8", b"\x89PNG", (b"II", b"MM")

_MAX_BYTES_PER_PIXEL = 6  # of an image at the pixel limit, such as PPM with 16 bits per channel
# Numbers of the TIFF format: a version, a tag and a type of values.
_BIG_TIFF, _ORIENTATION, _SHORT = 43, 274, 3
_TIFF_BYTES_PER_PIXEL = 32  # maximum: four numbers in double precision
# Classes of Pillow that read only the header, by the first bytes of the file.
_HEADERS: Mapping[bytes, Callable[[BytesIO], ImageFile]] = {
    _PNG_START: PngImageFile,
    b"BM": BmpImageFile,
    b"P": PpmImageFile,
    **dict.fromkeys(_TIFF_STARTS, TiffImageFile),
}

# Pixels are decoded as stored: ground truth from other tools refers to the stored orientation.
# OpenCV applies the orientation of TIFF data in spite of this flag; see `_without_orientation`.
_COLOUR = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION


class ImageFiles:
    """Frames in image files, read on request; `files` are in the order of the frames."""

    def __init__(self, files: abc.Sequence[Path]) -> None:
        self.files = files

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, frame: int) -> Image:
        """See `Frames`."""
        file = self.files[frame]
        remedy = "Download the file again, or end the ground truth before this frame."
        with decoding(f"{file}: frame {frame} cannot be read", remedy):
            return decode_image(read_image_file(file))


def read_image_file(file: Path) -> bytes:
    """Return the bytes of a file.

    Raises `ValueError` for a device or a pipe, which may never end, and `OSError` for a file that
    cannot be read.
    """
    if not stat.S_ISREG(file.stat().st_mode):
        raise ValueError("not a regular file")
    return file.read_bytes()


def image_size(encoded: bytes) -> tuple[int, int] | None:
    """Return the stored width and height from the header, or None if it is not readable."""
    encoded = _without_orientation(encoded)
    try:
        if encoded.startswith(_JPEG_START):
            height, width, *_ = simplejpeg.decode_jpeg_header(encoded)
            return width, height
        for start, plugin in _HEADERS.items():
            if encoded.startswith(start):
                return plugin(BytesIO(encoded)).size
    except PROGRAMMING_ERRORS:
        raise
    # Pillow raises exceptions of many types for a damaged header; the caller names the file.
    except Exception:  # noqa: BLE001
        return None
    return None


def decode_image(encoded: bytes) -> Image:
    """Decode an image file's bytes to 8-bit BGR.

    Pixels are returned as stored: an orientation tag is not applied. Grey images get three equal
    channels, 16-bit images keep the upper byte, alpha is dropped.

    Raises `ValueError` for data that are damaged, truncated or not an image, and for an image that
    is larger than `pixel_limit`. Raises `MemoryError` if decoding needs more memory than is
    available.
    """
    size = image_size(encoded)
    if size is None:
        # Formats that only OpenCV reads are refused: decoding a file of 50 bytes can take a minute
        # and gigabytes of memory.
        raise ValueError("not an image in the format JPEG, PNG, BMP, PPM or TIFF, or damaged")
    check_pixels(*size)
    _check_memory(encoded, size, _MAX_BYTES_PER_PIXEL * pixel_limit())
    if encoded.startswith(_JPEG_START):
        return np.asarray(simplejpeg.decode_jpeg(encoded, "BGR"), dtype=np.uint8)
    try:
        image = cv2.imdecode(np.frombuffer(_without_orientation(encoded), np.uint8), _COLOUR)
    except cv2.error as error:
        if error.code == cv2.Error.StsNoMem:
            raise MemoryError from None
        image = None
    if image is None:
        raise ValueError("damaged, truncated, or not an image")
    return np.asarray(image, dtype=np.uint8)


def _without_orientation(encoded: bytes) -> bytes:
    """Return TIFF data with the orientation 1 (as stored), and other data unchanged."""
    if not encoded.startswith(_TIFF_STARTS):
        return encoded
    order: Literal["little", "big"] = "little" if encoded.startswith(b"II") else "big"

    def integer(start: int, size: int) -> int:
        return int.from_bytes(encoded[start : start + size], order)

    # sizes of an offset, of the number of entries and of an entry; position of the first offset
    # [bytes]
    word, count, length, start = (8, 8, 20, 8) if integer(2, 2) == _BIG_TIFF else (4, 2, 12, 4)
    directory = integer(start, word)
    first = directory + count
    last = min(first + length * integer(directory, count), len(encoded) - length + 1)
    for position in range(first, last, length):
        if integer(position, 2) == _ORIENTATION:
            as_stored = (_ORIENTATION, 2), (_SHORT, 2), (1, word), (1, 2), (0, word - 2)
            values = b"".join(value.to_bytes(size, order) for value, size in as_stored)
            return encoded[:position] + values + encoded[position + length :]
    return encoded


def _check_memory(encoded: bytes, size: tuple[int, int], max_bytes: int) -> None:
    """Check that a decoder does not allocate more memory for data than the pixel limit implies.

    Raises `ValueError` for too many bytes per pixel, and for a PNG chunk whose stated length
    exceeds the file, because OpenCV allocates memory of the stated length.
    """
    depth = _TIFF_BYTES_PER_PIXEL if encoded.startswith(_TIFF_STARTS) else 3
    if encoded.startswith(_PNG_START):
        depth = (
            encoded[24] * {2: 3, 4: 2, 6: 4}.get(encoded[25], 1) // 8
        )  # bits per sample, colour type
        offset = 8
        while offset < len(encoded) and encoded[offset + 4 : offset + 8] != b"IEND":
            offset += int.from_bytes(encoded[offset : offset + 4], "big") + 12
        if offset > len(encoded):
            raise ValueError("a chunk is longer than the file: it is damaged or truncated")
    if size[0] * size[1] * depth > max_bytes:
        raise ValueError(
            f"its header states {size[0]}x{size[1]} pixels with up to {depth} bytes each; the "
            f"maximum is {max_bytes} bytes. Set {PIXEL_LIMIT_VARIABLE} to raise it"
        )


def image_files(folder: Path) -> list[Path]:
    """Return the image files directly in a folder, in natural order: `img2.png`, `img10.png`.

    Raises `SequenceError` for a name that is not UTF-8: messages and results cannot contain it.
    """
    files = [
        file
        for file in folder.iterdir()
        if file.suffix.lower() in SUFFIXES and not file.name.startswith(".")
    ]
    for file in files:
        check_name(file)
    return sorted(files, key=lambda file: natural_order(file.name))


def numbered_images(folder: Path, *firsts: int, names: str = "#") -> list[Path]:
    """Return the images directly in a folder whose names are consecutive numbers, in order.

    A missing image would shift the ground truth of all later frames.
    `firsts` are the valid numbers of the first image; without them, all numbers are valid. `names`
    is a name without suffix, such as `img#`, with # for the number; or `*` for all names.

    Raises `SequenceError` naming the image that is missing, has no number, or has the number of
    another image. If the folder has no images, the error names the folder.
    """
    images = image_files(folder) if folder.is_dir() else []
    if not images:
        raise SequenceError(f"{folder}: there are no images.")
    check_frame_numbers(images)
    if names == "*":
        return images
    digits = [digits_of_name(file, names) for file in images]

    def named(image_number: int, width: int) -> str:
        return names.replace("#", f"{image_number:0{width}}")

    for file, digits_of_file in zip(images, digits, strict=True):
        if not digits_of_file:
            raise SequenceError(
                f"{file}: the name is not a number. Expected: {named(0, 5)}.jpg, "
                f"{named(1, 5)}.jpg, …"
            )
    first_number, width = int(digits[0]), len(digits[0])
    if firsts and first_number not in firsts:
        first = min(firsts, key=lambda first: abs(first - first_number))
        missing = images[0].with_stem(named(first, width))
        problem = (
            f"{missing}: this image is missing; the first one is {images[0].name}. Add the file"
        )
        if first_number < first:
            problem = f"{images[0]}: the first image must be {missing.name}. Remove the file"
        raise SequenceError(f"{problem}, or number all images from {first}.")
    for (before, digits_before), (after, digits_after) in pairwise(
        zip(images, digits, strict=True)
    ):
        if int(digits_after) != int(digits_before) + 1:
            missing = before.with_stem(named(int(digits_before) + 1, len(digits_before)))
            raise SequenceError(
                f"{missing}: this image is missing between {before.name} and {after.name}. Add "
                "the file, or remove the images on one side of the gap."
            )
    return images


def digits_of_name(file: Path, names: str = "#") -> str:
    """Return the number in a name as `names` describes it; empty for another name."""
    before, _, after = names.partition("#")
    digits = file.stem.removeprefix(before).removesuffix(after)
    return digits if digits.isdecimal() and file.stem == before + digits + after else ""


def size_of_first(images: abc.Sequence[Path]) -> tuple[int, int]:
    """Return width and height of the first image from its header.

    Raises `SequenceError` if the header is not readable.
    """
    try:
        size = image_size(read_image_file(images[0]))
    except ValueError:  # a device or a pipe
        size = None
    if size is None:
        raise SequenceError(f"{images[0]}: damaged, or not an image. Download the file again.")
    return size
