"""Scene: stateless rendering of images, masks and ground truth."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask


@dataclass(frozen=True)
class SceneTruth:
    """Ground truth of the target in every frame."""

    # boxes that trackers are initialised and scored with [pixels], shape (n, 4): usually the
    # extents of the whole silhouette at mid-exposure, hidden parts included; NaN while the target
    # is out of view
    boxes: NDArray[np.float64]
    # share of the silhouette that is in view and not occluded, in [0, 1]; shape (n,)
    visibility: NDArray[np.float64]
    attributes: Mapping[str, NDArray[np.bool_]]  # flags per frame by name; shape (n,)
    # further ground-truth boxes by name, in the format of `boxes`; shape (n, 4)
    regions: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)


class SyntheticScene(ABC):
    """Renderer with its ground truth; as `Frames` it returns its images.

    `render` and `mask` depend on the frame number alone: any order, any process and any number of
    threads give the same bytes. The constructor renders neither textures nor images.
    """

    fps: float = 25.0  # frames per second
    length: int  # number of frames
    size: tuple[int, int]  # width and height of the images [pixels]

    def __len__(self) -> int:
        return self.length

    @abstractmethod
    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames without rendering."""

    @abstractmethod
    def render(self, frame: int) -> Image:
        """Return the image of a frame as a new array."""

    @abstractmethod
    def mask(self, frame: int) -> Mask:
        """Return the pixels of which the target covers at least one half at mid-exposure."""

    def __getitem__(self, frame: int) -> Image:
        return self.render(frame)


def part_generator(seed: int, part: str) -> np.random.Generator:
    """Return the random generator of one part of a scene; parts do not affect one another."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(crc32(part.encode()),)))


def paste_window(size: tuple[int, int], left: int, top: int, part: Image) -> Image:
    """Return an image of a width and height that is 0 except for a window, shape (h, w)."""
    whole = np.zeros(size[::-1], part.dtype)
    height, width = part.shape
    whole[top : top + height, left : left + width] = part
    return whole
