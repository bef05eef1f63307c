"""Sequences of DAVIS: `JPEGImages/480p/NAME/` and, beside it, `Annotations/480p/NAME/`.

Perazzi et al., "A benchmark dataset and evaluation methodology for video object segmentation",
CVPR 2016: a mask is 0 or 255. Pont-Tuset et al., "The 2017 DAVIS challenge on video object
segmentation", arXiv:1704.00675: its values number the objects from 1, and 255 is none of them.
"""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import check_pixels, decoding, quote
from trackmark.datasets.file_digest import file_digests
from trackmark.datasets.image_files import (
    image_files,
    image_size,
    numbered_images,
    size_of_first,
)
from trackmark.datasets.interface import Mask, Sequence, SequenceError
from trackmark.datasets.recorded import recorded_images

IMAGES, MASKS = "JPEGImages", "Annotations"
USUAL_RESOLUTION = "480p"
EXPECTS = f"a folder {IMAGES}/RESOLUTION/NAME with {MASKS}/RESOLUTION/NAME (DAVIS)"
GENERAL = False
MARKS: tuple[str, ...] = ()
CITATION = (
    "Perazzi et al., A benchmark dataset and evaluation methodology for video object segmentation, "
    "CVPR 2016; Pont-Tuset et al., The 2017 DAVIS challenge, arXiv:1704.00675"
)

# Belongs to no object where objects are numbered; where nothing else is, it is the object.
_VOID = 255


def recognises(path: Path) -> bool:
    """Whether it is a sequence's folder of images, or its name in the folder that holds all."""
    return _folders(path) is not None


def list_members(folder: Path) -> list[Path]:
    """Sequences in a folder of the whole benchmark, of its usual resolution; see `Collecting`."""
    kinds = [folder / kind for kind in (IMAGES, MASKS)]
    if not all(kind.is_dir() for kind in kinds):
        return []
    for resolution in sorted((place.name for place in kinds[0].iterdir()), key=_preference):
        names = {
            place.name
            for kind in kinds
            if (kind / resolution).is_dir()
            for place in (kind / resolution).iterdir()
            if place.is_dir()
        }
        return [folder / name for name in sorted(names)]
    return []


def options(path: Path) -> list[dict[str, Any]]:
    """What can be chosen: `object`; see `datasets.options`."""
    numbers = list(_objects(*_files(path)))
    meaning = f"which object of {', '.join(map(str, numbers))}"
    return [{"name": "object", "default": numbers[0], "meaning": meaning}]


def read(path: Path, truth: Path | None, chosen: Mapping[str, str] | None = None) -> Sequence:
    """Open the sequence of one object, by default the first; its boxes enclose its masks.

    A truth file takes the place of boxes and masks.
    """
    images, _ = _images(path)
    name = path.resolve().name
    if truth is not None:
        return recorded_images(name, images, truth_file.read(truth), truth)
    images, masks = _files(path)
    objects = _objects(images, masks)
    first = next(iter(objects))
    asked = (chosen or {}).get("object", str(first))
    if asked not in map(str, objects):
        known = ", ".join(map(str, objects))
        raise SequenceError(f"{path}: there is no object {quote(asked)}. There are: {known}.")
    target = objects[int(asked)]
    return recorded_images(
        name if int(asked) == first else f"{name}:object={asked}",
        images,
        truth_file.GroundTruth(target.boxes),
        masks[0].parent,
        masks=target.mask,
        digests=lambda files: file_digests([*files, *masks]),
    )


@dataclass(frozen=True)
class _Object:
    """A value in masks."""

    files: list[Path]  # the masks, a file a frame
    value: int  # of the object's pixels
    boxes: NDArray[np.float64]  # (n, 4): its tight bounding boxes; NaN where it has no pixel

    def mask(self, frame: int) -> Mask:
        """Its pixels in a frame."""
        return np.asarray(_values(self.files[frame]) == self.value)


def _objects(images: list[Path], masks: list[Path]) -> dict[int, _Object]:
    """Objects by number, in order; all masks are read for it."""
    width, height = size_of_first(images)
    boxes: dict[int, NDArray[np.float64]] = {}
    for frame, file in enumerate(masks):
        values = _values(file)
        if values.shape != (height, width):
            raise SequenceError(
                f"{file}: the mask has {values.shape[1]}x{values.shape[0]} pixels, the images have "
                f"{width}x{height}. Get the masks of their resolution."
            )
        # NumPy would count in eight bytes a pixel.
        there = cv2.calcHist([values], [0], None, [256], [0, 256]).ravel()
        for value in (1 + np.flatnonzero(there[1:])).tolist():
            rows = boxes.setdefault(value, np.full((len(masks), 4), np.nan))
            rows[frame] = cv2.boundingRect((values == value).view(np.uint8))
    if not boxes:
        raise SequenceError(f"{masks[0].parent}: all masks are empty, so there is no object.")
    if list(boxes) == [_VOID]:
        return {1: _Object(masks, _VOID, boxes[_VOID])}
    return {value: _Object(masks, value, boxes[value]) for value in sorted(boxes) if value != _VOID}


def _values(file: Path) -> NDArray[np.uint8]:
    """Values of a mask's pixels: of a palette image, which colours they are."""
    with decoding(f"{file}: the mask can't be read"):
        data = file.read_bytes()
        size = image_size(data)
        if size is not None:
            check_pixels(*size)
        with Image.open(io.BytesIO(data)) as image:
            image.verify()  # its checksums, which decoding passes over
        with Image.open(io.BytesIO(data)) as image:
            mode, values = image.mode, np.asarray(image)
    if mode not in ("1", "L", "P"):
        raise SequenceError(
            f"{file}: the mask is an image of colours ({mode}); expected are 8-bit grey values or "
            "a palette, as DAVIS has them."
        )
    return values.astype(np.uint8)


def _folders(path: Path) -> tuple[Path, Path] | None:
    """Folders of a sequence's images and masks; None where this is no sequence of DAVIS."""
    whole = path.resolve()
    if whole.parents[1:2] and whole.parents[1].name == IMAGES:
        root, candidates = whole.parents[2], [whole.parent.name]
    else:
        root = whole.parent
        there = (root / IMAGES).iterdir() if (root / IMAGES).is_dir() else ()
        candidates = sorted((folder.name for folder in there), key=_preference)
    for resolution in candidates:
        images, masks = (root / kind / resolution / whole.name for kind in (IMAGES, MASKS))
        if images.is_dir() and masks.is_dir():
            return images, masks
    return None


def _preference(resolution: str) -> tuple[bool, str]:
    """A key to sort by: the usual resolution first."""
    return resolution != USUAL_RESOLUTION, resolution


def _images(path: Path) -> tuple[list[Path], Path]:
    """Images in order, and the folder of their masks.

    Raises `SequenceError` naming the image that is missing, or has no number.
    """
    folders = _folders(path)
    assert folders is not None  # asked of what is recognised alone
    return numbered_images(folders[0]), folders[1]


def _files(path: Path) -> tuple[list[Path], list[Path]]:
    """Images and their masks, one a frame.

    Raises `SequenceError` naming an image or a mask that is missing.
    """
    images, folder = _images(path)
    masks = [folder / f"{image.stem}.png" for image in images]
    there = set(image_files(folder))
    for mask in masks:
        if mask not in there:
            raise SequenceError(
                f"{mask}: there is no such mask; every image has one. Get the file, or give boxes "
                "in a truth file."
            )
    for mask in sorted(there.difference(masks)):
        raise SequenceError(f"{mask}: there is no image to this mask. Get it, or remove this.")
    return images, masks
