"""Interface of scenes: rendered images, masks and ground truth."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from zlib import crc32

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.parameters import SceneParameters


@dataclass(frozen=True)
class SceneTruth:
    """Ground truth of the target in every frame."""

    # shape (n, 4) [pixels]: usually around the whole silhouette at mid-exposure, including occluded
    # parts; NaN while the target is outside the image
    boxes: Array
    # shape (n,): fraction of the silhouette that is inside the image and not occluded, in [0, 1]
    visibility: Array
    attributes: Mapping[str, NDArray[np.bool_]]  # shape (n,): flags of frames, by name
    # further ground-truth boxes by name, in the format of `boxes`
    regions: Mapping[str, Array] = field(default_factory=dict)


class SyntheticScene(ABC):
    """Renderer with its ground truth; it implements `Frames`.

    `render` and `mask` depend only on the frame number: the bytes are equal in any order, process
    or thread. The constructor renders nothing.
    """

    fps: float = 25.0  # frames per second
    length: int  # number of frames
    size: tuple[int, int]  # width and height of the images [pixels]

    def __len__(self) -> int:
        return self.length

    @abstractmethod
    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames; no image is rendered."""

    @abstractmethod
    def render(self, frame: int) -> Image:
        """Return the image of a frame as a new array."""

    @abstractmethod
    def mask(self, frame: int) -> Mask:
        """Return the mask of pixels that the target covers at least by half at mid-exposure."""

    def __getitem__(self, frame: int) -> Image:
        return self.render(frame)


class SeededScene(SyntheticScene):
    """Scene whose only parameter is its seed.

    `label` is the start of the names of its random generators.
    """

    label: str

    def __init__(self, parameters: SceneParameters) -> None:
        self._seed = parameters.scene

    def _random(self, part: str) -> Generator:
        return part_generator(self._seed, f"{self.label} {part}")


def part_generator(seed: int, part: str) -> Generator:
    """Return the random generator of one part of a scene; all parts are independent."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(crc32(part.encode()),)))


def paste_window(size: tuple[int, int], left: int, top: int, part: Image) -> Image:
    """Return an image with a width and height that is 0 except in a window, shape (h, w)."""
    whole = np.zeros(size[::-1], part.dtype)
    height, width = part.shape
    whole[top : top + height, left : left + width] = part
    return whole
