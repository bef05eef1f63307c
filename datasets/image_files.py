"""Images in files, decoded strictly: damaged data are an error, never grey pixels."""

import re
from collections.abc import Sequence as SequenceOf
from pathlib import Path

import cv2
import numpy as np
import simplejpeg

from datasets.interface import Image, SequenceError

__all__ = ["SUFFIXES", "ImageFiles", "decode_image", "image_files"]

SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".ppm", ".tif", ".tiff")

_JPEG_START = b"\xff\xd8"

# The pixels as they are stored, whatever a camera noted about how it was held: JPEG data
# are decoded so, and a truth made elsewhere counts from the stored corner.
_COLOUR = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION


class ImageFiles:
    """Frames that lie in image files of one size.

    Parameters
    ----------
    files : sequence of Path
        In the order of the frames; nothing is read before a frame is asked for.
    """

    def __init__(self, files: SequenceOf[Path]) -> None:
        self._files = files
        self._shape: tuple[int, ...] | None = None

    def __len__(self) -> int:
        return len(self._files)

    def __getitem__(self, frame: int) -> Image:
        """See `Frames`."""
        if self._shape is None:
            self._shape = self._read(0).shape
        image = self._read(frame)
        if image.shape != self._shape:
            height, width = image.shape[:2]
            raise SequenceError(
                f"{self._files[frame]}: frame {frame} has {width}x{height} pixels, the first "
                f"image {self._shape[1]}x{self._shape[0]}. All images must be of one size."
            )
        return image

    def _read(self, frame: int) -> Image:
        file = self._files[frame]
        try:
            return decode_image(file.read_bytes())
        except (OSError, ValueError) as error:
            raise SequenceError(
                f"{file}: frame {frame} can't be read ({error}). "
                "Get the file anew, or end the truth before this frame."
            ) from error


def decode_image(data: bytes) -> Image:
    """Decode an image file's bytes to 8-bit BGR.

    Grey images get three equal channels, 16-bit ones keep the upper byte, alpha is dropped.

    Returns
    -------
    image : ndarray of uint8, shape (height, width, 3)

    Raises
    ------
    ValueError
        For data that are damaged, cut short, or no image.
    """
    if data.startswith(_JPEG_START):
        return np.asarray(simplejpeg.decode_jpeg(data, "BGR"), dtype=np.uint8)
    image = cv2.imdecode(np.frombuffer(data, np.uint8), _COLOUR) if data else None
    if image is None:
        raise ValueError("damaged, cut short, or not an image")
    return np.asarray(image, dtype=np.uint8)


def image_files(folder: Path) -> list[Path]:
    """Image files directly in a folder, in natural order: `img2.png` before `img10.png`."""
    files = [
        file
        for file in folder.iterdir()
        if file.suffix.lower() in SUFFIXES and not file.name.startswith(".")
    ]
    return sorted(files, key=_natural_order)


def _natural_order(file: Path) -> tuple[list[str | int], str]:
    # Splitting at digits gives text and numbers in turn, so that like meets like.
    parts = re.split(r"([0-9]+)", file.name)
    return [int(part) if i % 2 else part for i, part in enumerate(parts)], file.name
