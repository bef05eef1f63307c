"""A scene: what is drawn and what is true of it, frame by frame and without memory."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask


@dataclass(frozen=True)
class SceneTruth:
    """What is true of the target in every frame."""

    # what trackers start from and are scored by, hidden parts included, in pixels; as a rule the
    # extents of the whole silhouette at mid-exposure. NaN rows where nothing of it is in view;
    # shape (n, 4)
    boxes: NDArray[np.float64]
    # fraction of the silhouette's area that is in view and not hidden, in [0, 1]; shape (n,)
    visibility: NDArray[np.float64]
    attributes: Mapping[str, NDArray[np.bool_]]  # what happens when; shape (n,)
    # further truths by name, as `boxes`; shape (n, 4)
    regions: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)


class SyntheticScene(ABC):
    """A renderer with its truth; as `Frames` it gives its images.

    `render` and `mask` depend on the frame's number alone: any order, any process and any
    number of threads give the same bytes. Making a scene costs neither textures nor images.
    """

    fps: float = 25.0  # frames a second
    length: int  # number of frames
    size: tuple[int, int]  # width and height of the images [pixels]

    def __len__(self) -> int:
        return self.length

    @abstractmethod
    def truth(self) -> SceneTruth:
        """Truth of all frames; renders nothing."""

    @abstractmethod
    def render(self, frame: int) -> Image:
        """Image of a frame, a fresh array."""

    @abstractmethod
    def mask(self, frame: int) -> Mask:
        """Pixels that show the target at mid-exposure, at least to one half."""

    def __getitem__(self, frame: int) -> Image:
        return self.render(frame)


def part_generator(seed: int, part: str) -> np.random.Generator:
    """Random numbers of one part of a scene: a new part changes no other's."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(crc32(part.encode()),)))


def paste_window(size: tuple[int, int], left: int, top: int, part: Image) -> Image:
    """An image of a width and height that is 0 but for a part of it, shape (h, w)."""
    whole = np.zeros(size[::-1], part.dtype)
    height, width = part.shape
    whole[top : top + height, left : left + width] = part
    return whole
