"""Sequences of DAVIS: `JPEGImages/480p/NAME/` and `Annotations/480p/NAME/`.

YouTube-VOS and LVOS have no folder for the resolution, and masks for some of the images: the other
frames are not annotated.

Perazzi et al., "A benchmark dataset and evaluation methodology for video object segmentation",
CVPR 2016: a mask has the values 0 and 255. Pont-Tuset et al., "The 2017 DAVIS challenge on video
object segmentation", arXiv:1704.00675: values are object numbers from 1, and 255 means no object.
In test sets only the first mask is public: later frames are not annotated and not scored.
"""

import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import check_pixels, decoding
from trackmark.datasets.file_digest import file_stamp
from trackmark.datasets.image_files import (
    image_files,
    image_size,
    numbered_images,
    size_of_first,
)
from trackmark.datasets.interface import Array, Mask, Sequence, SequenceError
from trackmark.datasets.recorded import Choice, recorded
from trackmark.datasets.truth_file import GroundTruth

IMAGES, MASKS = "JPEGImages", "Annotations"
PATH_IS_ONE_TARGET = True
USUAL_RESOLUTION = "480p"

# If masks have other values too, this value means no object. As the only value, it is the object.
_VOID = 255


def recognises(path: Path) -> bool:
    """Return whether the path is an image folder, or `ROOT/NAME` for the sequence `NAME`."""
    return _locate(path) is not None


def list_members(folder: Path) -> list[Path]:
    """Return the sequences of one resolution, 480p if it exists."""
    roots = [folder / IMAGES, folder / MASKS]
    if not all(root.is_dir() for root in roots):
        return []
    for resolution in _resolutions(folder):
        names = {
            path.name
            for root in roots
            for path in (root / resolution).glob("*")
            if path.is_dir() and (resolution != "." or image_files(path))
        }
        if names:
            return [folder / name for name in sorted(names)]
    return []


def choice(path: Path) -> Choice:
    """Return the option `object`."""
    numbers = list(_read_objects(*_files(path)))
    return Choice("object", numbers, numbers[0])


def read(path: Path, truth: Path | None, value: str) -> Sequence:
    """Open the sequence of one object, by default the first; its boxes enclose its masks.

    A given ground-truth file replaces boxes and masks.
    """
    name = path.resolve().name
    if truth is not None:
        return recorded(name, _images(path)[0], truth_file.read(truth), truth)
    images, masks = _files(path)
    objects = _read_objects(images, masks)
    object_number = value or next(iter(objects))
    target = objects[object_number]
    annotated = np.array([image.stem in target.files for image in images])
    boxes = np.full((len(images), 4), np.nan)
    boxes[annotated] = target.boxes
    return recorded(
        name if object_number == next(iter(objects)) else f"{name}:object={object_number}",
        images,
        GroundTruth(boxes, annotated=annotated),
        masks[0].parent,
        masks=lambda frame: target.mask(images[frame].stem),
        further_files=masks,
    )


@dataclass(frozen=True)
class _Object:
    """Object of a sequence, identified by its value in the masks."""

    files: Mapping[str, Path]  # mask files by frame, in order
    value: int
    boxes: Array  # shape (len(files), 4): tight bounding boxes; NaN if the object has no pixel

    def mask(self, frame: str) -> Mask:
        """Return the pixels of the object in an annotated frame."""
        return np.asarray(_read_values(self.files[frame]) == self.value)


def _read_objects(images: list[Path], masks: list[Path]) -> dict[str, _Object]:
    """Read all masks and return the objects by number, sorted; see `_cached_objects`."""
    return _cached_objects(images[0], tuple((file, file_stamp(file)) for file in masks))


@lru_cache(maxsize=64)
def _cached_objects(
    first_image: Path, stamps: tuple[tuple[Path, tuple[int, int]], ...]
) -> dict[str, _Object]:
    """Read all masks; a folder is listed and its objects are opened from one reading.

    `stamps` are the mask files with their stamps.
    """
    masks = [file for file, _ in stamps]
    width, height = size_of_first([first_image])
    boxes: dict[int, Array] = {}
    for frame, file in enumerate(masks):
        values = _read_values(file)
        if values.shape != (height, width):
            raise SequenceError(
                f"{file}: the mask has {values.shape[1]}x{values.shape[0]} pixels, the images have "
                f"{width}x{height}. Use masks and images of the same resolution."
            )
        # `np.bincount` would convert the pixels to eight bytes each.
        counts = cv2.calcHist([values], [0], None, [256], [0, 256]).ravel()
        for value in (1 + np.flatnonzero(counts[1:])).tolist():
            rows = boxes.setdefault(value, np.full((len(masks), 4), np.nan))
            rows[frame] = cv2.boundingRect((values == value).view(np.uint8))
    if not boxes:
        raise SequenceError(f"{masks[0].parent}: all masks are empty. Expected: an object.")
    files = {mask.stem: mask for mask in masks}
    if list(boxes) == [_VOID]:
        return {"1": _Object(files, _VOID, boxes[_VOID])}
    object_values = sorted(boxes.keys() - {_VOID})
    return {str(value): _Object(files, value, boxes[value]) for value in object_values}


def _read_values(file: Path) -> NDArray[np.uint8]:
    """Return the values of a mask's pixels; in a palette image, the indices of the colours."""
    with decoding(f"{file}: the mask cannot be read"):
        encoded = file.read_bytes()
        size = image_size(encoded)
        if size is not None:
            check_pixels(*size)
        with Image.open(io.BytesIO(encoded)) as image:
            image.verify()  # verifies the checksums, which decoding ignores
        with Image.open(io.BytesIO(encoded)) as image:
            mode, values = image.mode, np.asarray(image)
    if mode not in ("1", "L", "P"):
        raise SequenceError(
            f"{file}: the mask is a colour image ({mode}). Expected: 8-bit grey values or palette."
        )
    return values.astype(np.uint8)


def _locate(path: Path) -> tuple[Path, Path] | None:
    """Return a sequence's folders of images and masks; None for another format."""
    full = path.resolve()
    images_root = next((parent for parent in full.parents[:2] if parent.name == IMAGES), None)
    root = full.parent if images_root is None else images_root.parent
    inside = None if images_root is None else full.parent.relative_to(images_root).as_posix()
    for resolution in _resolutions(root) if inside is None else [inside]:
        images, masks = (root / folder / resolution / full.name for folder in (IMAGES, MASKS))
        if images.is_dir() and masks.is_dir() and (resolution != "." or image_files(images)):
            return images, masks
    return None


def _resolutions(root: Path) -> Iterator[str]:
    """Yield `.` for data without folders of resolutions, and these folders, 480p first."""
    yield "."
    folders = (root / IMAGES).iterdir() if (root / IMAGES).is_dir() else ()
    names = sorted(folder.name for folder in folders)
    yield from sorted(names, key=lambda name: name != USUAL_RESOLUTION)


def _images(path: Path) -> tuple[list[Path], Path]:
    """Return the images in order, and the folder of their masks.

    Raises `SequenceError` naming an image that is missing or has no number.
    """
    folders = _locate(path)
    assert folders is not None  # `recognises` is true
    names = "*" if _is_sparse(folders[0]) else "#"
    return numbered_images(folders[0], names=names), folders[1]


def _is_sparse(images: Path) -> bool:
    """Return whether not every image needs a mask, as in YouTube-VOS and LVOS."""
    return images.parent.name == IMAGES


def _files(path: Path) -> tuple[list[Path], list[Path]]:
    """Return the images and their masks in order: one per image, or fewer; see `_is_sparse`.

    In test sets, only the first image has a mask. Raises `SequenceError` naming an image or a mask
    that is missing.
    """
    images, folder = _images(path)
    masks = [folder / f"{image.stem}.png" for image in images]
    mask_files = set(image_files(folder))
    for mask in sorted(mask_files.difference(masks)):
        raise SequenceError(f"{mask}: the mask has no image. Add the image, or remove the mask.")
    if _is_sparse(images[0].parent) and mask_files:
        return images, [mask for mask in masks if mask in mask_files]
    if mask_files == {masks[0]}:
        return images, masks[:1]
    for mask in masks:
        if mask not in mask_files:
            raise SequenceError(
                f"{mask}: this mask is missing. Expected: one mask per image. Add the file, or "
                "give boxes in a ground-truth file."
            )
    return images, masks
