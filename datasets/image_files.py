"""Images in files, decoded strictly: damaged data are an error, never grey pixels."""

from collections.abc import Callable, Mapping
from collections.abc import Sequence as SequenceOf
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
    PROGRAMMING_ERRORS,
    check_name,
    check_pixels,
    decoding,
    pixel_limit,
)
from trackmark.datasets.frame_numbers import check_frame_numbers
from trackmark.datasets.interface import Image, SequenceError
from trackmark.datasets.spec_string import natural_order

SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".ppm", ".tif", ".tiff")

_JPEG_START, _PNG_START, _TIFF_STARTS = b"\xff\xd8", b"\x89PNG", (b"II", b"MM")

_MOST_BYTES = 6  # a pixel, where there are as many as may be: of a PPM file of 16 bits
# Numbers of the TIFF format: a version, a tag and a type of values.
_BIG_TIFF, _ORIENTATION, _SHORT = 43, 274, 3
_TIFF_BYTES = 32  # a pixel, at most: four numbers in double precision
# What reads no more than a header, by how a file begins.
_HEADERS: Mapping[bytes, Callable[[BytesIO], ImageFile]] = {
    _PNG_START: PngImageFile,
    b"BM": BmpImageFile,
    b"P": PpmImageFile,
    **dict.fromkeys(_TIFF_STARTS, TiffImageFile),
}

# Pixels are decoded as stored: ground truth from other tools counts from the stored corner. OpenCV
# applies the orientation of TIFF data in spite of this flag; see `_without_orientation`.
_COLOUR = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION


class ImageFiles:
    """Frames that lie in image files.

    `files`: In the order of the frames; nothing is read before a frame is asked for. `most_pixels`:
    See `decode_image`.
    """

    def __init__(self, files: SequenceOf[Path], most_pixels: int | None = None) -> None:
        self.files = files
        self._most_pixels = most_pixels

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, frame: int) -> Image:
        """See `Frames`."""
        file = self.files[frame]
        advice = "Get the file anew, or end the truth before this frame."
        with decoding(f"{file}: frame {frame} can't be read", advice):
            return decode_image(file.read_bytes(), self._most_pixels)


def image_size(data: bytes) -> tuple[int, int] | None:
    """Return the stored width and height by the header, None if it is not readable."""
    data = _without_orientation(data)
    try:
        if data.startswith(_JPEG_START):
            height, width, *_ = simplejpeg.decode_jpeg_header(data)
            return width, height
        for start, plugin in _HEADERS.items():
            if data.startswith(start):
                return plugin(BytesIO(data)).size
    except PROGRAMMING_ERRORS:
        raise
    # Pillow raises exceptions of many types for a damaged header; the caller names the file.
    except Exception:  # noqa: BLE001
        return None
    return None


def decode_image(data: bytes, most_pixels: int | None = None) -> Image:
    """Decode an image file's bytes to 8-bit BGR.

    Pixels are returned as stored: an orientation tag is not applied. Grey images get three equal
    channels, 16-bit images keep the upper byte, alpha is dropped.

    `data`: Of the file. `most_pixels`: A larger image is refused by its header; see
    `datasets.decoding.pixel_limit`.
    Raises `ValueError` for data that are damaged, cut short, or no image, and for an image that is
    too large. Raises `MemoryError` where decoding takes more memory than there is.
    """
    size = image_size(data)
    if size is None:
        # OpenCV knows more formats, of which fifty bytes may take it a minute and gigabytes.
        raise ValueError("not an image of JPEG, PNG, BMP, PPM or TIFF, or damaged")
    check_pixels(*size, most_pixels)
    _check_memory(data, size, pixel_limit(most_pixels))
    if data.startswith(_JPEG_START):
        return np.asarray(simplejpeg.decode_jpeg(data, "BGR"), dtype=np.uint8)
    try:
        image = cv2.imdecode(np.frombuffer(_without_orientation(data), np.uint8), _COLOUR)
    except cv2.error as error:
        if error.code == cv2.Error.StsNoMem:
            raise MemoryError from None
        image = None
    if image is None:
        raise ValueError("damaged, cut short, or not an image")
    return np.asarray(image, dtype=np.uint8)


def _without_orientation(data: bytes) -> bytes:
    """Return TIFF data whose orientation tag has the value 1 (as stored), other data unchanged."""
    if not data.startswith(_TIFF_STARTS):
        return data
    order: Literal["little", "big"] = "little" if data.startswith(b"II") else "big"

    def number(start: int, size: int) -> int:
        return int.from_bytes(data[start : start + size], order)

    # Sizes of an offset, of the number of entries and of an entry; the start of the first offset.
    word, count, length, start = (8, 8, 20, 8) if number(2, 2) == _BIG_TIFF else (4, 2, 12, 4)
    directory = number(start, word)
    first = directory + count
    last = min(first + length * number(directory, count), len(data) - length + 1)
    for entry in range(first, last, length):
        if number(entry, 2) == _ORIENTATION:
            as_stored = (_ORIENTATION, 2), (_SHORT, 2), (1, word), (1, 2), (0, word - 2)
            values = b"".join(value.to_bytes(size, order) for value, size in as_stored)
            return data[:entry] + values + data[entry + length :]
    return data


def _check_memory(data: bytes, size: tuple[int, int], most: int) -> None:
    """Refuse what would take a decoder more memory than pixels of three bytes do.

    Raises `ValueError` for as many pixels of many bytes, and for parts of a PNG file that say to be
    longer than the file, for which OpenCV would make room.
    """
    depth = _TIFF_BYTES if data.startswith(_TIFF_STARTS) else 3
    if data.startswith(_PNG_START):
        depth = data[24] * {2: 3, 4: 2, 6: 4}.get(data[25], 1) // 8  # bits a sample, kind of colour
        at = 8
        while at < len(data) and data[at + 4 : at + 8] != b"IEND":
            at += int.from_bytes(data[at : at + 4], "big") + 12
        if at > len(data):
            raise ValueError("a part of it is longer than the file: it is damaged, or cut short")
    if size[0] * size[1] * depth > _MOST_BYTES * most:
        raise ValueError(
            f"it claims {size[0]}x{size[1]} pixels, too many where one may have {depth} bytes; "
            "TRACKMARK_MOST_PIXELS sets another limit"
        )


def image_files(folder: Path) -> list[Path]:
    """Image files directly in a folder, in natural order: `img2.png` before `img10.png`.

    Raises `SequenceError` for a name that is no UTF-8: it could stand in no message and no result.
    """
    files = [
        file
        for file in folder.iterdir()
        if file.suffix.lower() in SUFFIXES and not file.name.startswith(".")
    ]
    for file in files:
        check_name(file)
    return sorted(files, key=lambda file: natural_order(file.name))


def numbered_images(folder: Path, *firsts: int) -> list[Path]:
    """Return the images directly in a folder whose names are consecutive numbers, in order.

    A missing image would shift the ground truth of all later frames.
    `firsts`: valid numbers of the first image; none if the ground truth itself contains it.

    Raises `SequenceError` naming the image that is missing, has no number, or has the number of
    another image; or the folder if it has no images.
    """
    images = image_files(folder) if folder.is_dir() else []
    if not images:
        raise SequenceError(f"{folder}: there are no images.")
    check_frame_numbers(images)
    for file in images:
        if not file.stem.isdecimal():
            raise SequenceError(
                f"{file}: its name is no number; images here are called 00000.jpg, 00001.jpg, …"
            )
    number = int(images[0].stem)
    if firsts and number not in firsts:
        first = min(firsts, key=lambda first: abs(first - number))
        missing = images[0].with_stem(f"{first:0{len(images[0].stem)}}")
        wrong = (
            f"{missing}: there is no such image; the first one is {images[0].name}. Get the file"
        )
        if number < first:
            wrong = f"{images[0]}: images here begin with {missing.name}. Remove the file"
        raise SequenceError(f"{wrong}, or number all images from {first}.")
    for before, after in pairwise(images):
        if int(after.stem) != int(before.stem) + 1:
            missing = before.with_stem(f"{int(before.stem) + 1:0{len(before.stem)}}")
            raise SequenceError(
                f"{missing}: there is no such image between {before.name} and {after.name}. "
                "Get the file, or remove those on one side of the gap."
            )
    return images


def size_of_first(images: SequenceOf[Path]) -> tuple[int, int]:
    """Width and height of the first image; no more than its head is decoded.

    Raises `SequenceError` where that can't be told.
    """
    size = image_size(images[0].read_bytes())
    if size is None:
        raise SequenceError(f"{images[0]}: this is no image, or damaged. Get the file anew.")
    return size
