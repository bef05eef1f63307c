"""A sequence: images that come lazily, and what is true of the target in them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.shapes import Shapes

Image: TypeAlias = NDArray[np.uint8]
Mask: TypeAlias = NDArray[np.bool_]

LARGEST = 1e7  # greatest coordinate of a truth box [pixels]: images end long before


class SequenceError(ValueError):
    """A sequence that cannot be opened, read or run; the message names file and frame."""


@dataclass(frozen=True)
class Summary:
    """What is known of a built-in sequence before it is opened.

    Attributes
    ----------
    length : int
        Number of frames.
    size : tuple of int
        Width and height of the images [pixels].
    """

    length: int
    size: tuple[int, int]


@dataclass(frozen=True)
class Origin:
    """Where recorded data come from; a field is empty where nothing is known.

    Attributes
    ----------
    format : str
        What they were taken for.
    licence : str
        Under which one may use them.
    citation : str
        The paper to cite.
    description : str
        What the data say of the target or the scene, in words.
    """

    format: str = ""
    licence: str = ""
    citation: str = ""
    description: str = ""


class Frames(Protocol):
    """Where a sequence's images come from: a folder, a video file, a renderer."""

    def __len__(self) -> int:
        """Number of images."""
        ...

    def __getitem__(self, frame: int) -> Image:
        """Image of a frame in `range(len(self))`, decoded or rendered when asked for.

        Asking in order is the fast way; any order gives the same images, all of one size. Raises
        `SequenceError` for an image that cannot be read.
        """
        ...


class Sequence:
    """Images of one target, in order, with the truth about it.

    Parameters
    ----------
    name : str
        Canonical name: what results are filed under.
    frames : Frames
        The images. Those beyond the last truth row are not part of the sequence.
    boxes : array of float64, shape (n, 4), optional
        Truth `[x, y, width, height]` in pixels from 0; a NaN row where the target is
        absent. Without it every row is NaN: such a sequence opens and shows, but can't
        be evaluated.
    fingerprint : str or callable
        Changes when a pixel or a truth value changes; a callable is asked once, when needed.
    regions : mapping of str to array of shape (n, 4), optional
        Further truths by name (`full`, `tight`, …).
    visibility : array of shape (n,), optional
        Visible fraction in [0, 1]; NaN where unknown.
    attributes : mapping of str to bool array of shape (n,), optional
        What happens when (`occlusion`, …).
    fps : float, optional
        Frames a second.
    masks : callable, optional
        Gives the mask of a frame, or None where there is none.
    frame_names : sequence of str, optional
        What a reader of a message knows a frame by (a file name); `frame i` by default.
    truth_source : str
        File or generator that the truth comes from, for messages.
    truth_missing : str
        Why there is none, though a file looks like one: a sentence.
    image_size : tuple of int, optional
        Width and height in pixels, where they are known without reading an image.
    values : mapping of str to array of shape (n,), optional
        Numbers that the data bring by name and frame (VOT's `anchor`).
    origin : Origin, optional
        Where the data come from.
    shapes : Shapes, optional
        By frame the polygon or mask that the box is around; `regions` are boxes.

    Attributes
    ----------
    frames : Frames
        All images, those beyond the last truth row too; indexing the sequence gives only
        its own.
    images_beyond_truth : int
        Number of the others.
    known_size : tuple of int or None
        Width and height in pixels, where they are known without reading an image; see `image_size`.

    Raises
    ------
    SequenceError
        For truth that does not fit the images: more rows than images, wrong shapes, boxes that
        no image reaches.
    """

    def __init__(
        self,
        name: str,
        frames: Frames,
        boxes: ArrayLike | None = None,
        *,
        fingerprint: str | Callable[[], str],
        regions: Mapping[str, ArrayLike] | None = None,
        visibility: ArrayLike | None = None,
        attributes: Mapping[str, ArrayLike] | None = None,
        fps: float | None = None,
        masks: Callable[[int], Mask | None] | None = None,
        frame_names: list[str] | None = None,
        truth_source: str = "",
        truth_missing: str = "",
        image_size: tuple[int, int] | None = None,
        values: Mapping[str, ArrayLike] | None = None,
        origin: Origin | None = None,
        shapes: Shapes | None = None,
    ) -> None:
        self.name = name
        self.origin = origin or Origin()
        self.fps = fps
        self.truth_source = truth_source or name
        self.truth_missing = truth_missing
        self.frames, self._frame_names = frames, frame_names
        self._masks, self.shapes = masks, shapes
        self.known_size = image_size
        self._fingerprint = fingerprint

        n_images = len(frames)
        if n_images == 0:
            raise SequenceError(f"{name}: there are no images.")
        if boxes is None:
            self.boxes = _column(np.full((n_images, 4), np.nan), n_images, 4, "boxes", name)
        else:
            rows = np.asarray(boxes, dtype=np.float64)
            if len(rows) > n_images:
                raise SequenceError(
                    f"{self.truth_source}: {len(rows)} truth rows for {n_images} images of "
                    f"{name}. Cut the truth, or supply the missing images."
                )
            self.boxes = _column(rows, len(rows), 4, "boxes", name)
        n = len(self.boxes)
        self._check_reach()
        self.images_beyond_truth = n_images - n
        self.regions = {
            key: _column(np.asarray(value, np.float64), n, 4, f"region {key}", name)
            for key, value in (regions or {}).items()
        }
        self.values = {
            key: _column(np.asarray(value, np.float64), n, None, f"value {key}", name)
            for key, value in (values or {}).items()
        }
        given = np.full(n, np.nan) if visibility is None else np.asarray(visibility, np.float64)
        self.visibility = _column(given, n, None, "visibility", name)
        self.attributes = {
            key: _flags(value, n, f"attribute {key}", name)
            for key, value in (attributes or {}).items()
        }

    def __len__(self) -> int:
        return len(self.boxes)

    @overload
    def __getitem__(self, index: int) -> Image: ...

    @overload
    def __getitem__(self, index: slice) -> "Sequence": ...

    def __getitem__(self, index: int | slice) -> "Image | Sequence":
        """Image of a frame (read-only), or the sequence of a slice of the frames.

        Raises `SequenceError` for an image that can't be read, or is of another size than those
        before it.
        """
        if isinstance(index, slice):
            return self._slice(index)
        frame = index + len(self) if index < 0 else index
        if not 0 <= frame < len(self):
            raise IndexError(f"{self.name}: no frame {index}; there are {len(self)}.")
        image = self.frames[frame]
        height, width = image.shape[:2]
        if self.known_size is None:
            self.known_size = width, height
        if self.known_size != (width, height):
            expected = "x".join(map(str, self.known_size))
            raise SequenceError(
                f"{self.name}: {self.frame_name(frame)} has {width}x{height} pixels, others have "
                f"{expected}. Bring all to one size, or end the truth before this frame."
            )
        image.flags.writeable = False
        return image

    def __iter__(self) -> Iterator[Image]:
        for frame in range(len(self)):
            yield self[frame]

    def __repr__(self) -> str:
        return f"<Sequence {self.name}: {len(self)} frames>"

    @property
    def fingerprint(self) -> str:
        """Changes when a pixel or a truth value changes, and only then."""
        if not isinstance(self._fingerprint, str):
            self._fingerprint = self._fingerprint()
        return self._fingerprint

    @property
    def present(self) -> NDArray[np.bool_]:
        """Where the target is present, shape (n,)."""
        return np.asarray(np.isfinite(self.boxes).all(axis=1))

    @property
    def first_frame(self) -> int:
        """First frame in which the target is present: where trackers are initialised.

        Raises
        ------
        SequenceError
            Where the sequence has no truth.
        """
        present = np.flatnonzero(self.present)
        if len(present) == 0:
            missing = f" {self.truth_missing}" if self.truth_missing else ""
            raise SequenceError(
                f"{self.name}: there is no truth, so no tracker can be started or scored.{missing} "
                "Give a truth file (--truth FILE, CSV frame,x,y,width,height), or make one "
                "with `trackmark annotate`."
            )
        return int(present[0])

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of the images [pixels]; one is read where they are not known.

        Raises `SequenceError` where there is no truth, or that image can't be read.
        """
        if self.known_size is None:
            height, width = self[self.first_frame].shape[:2]
            self.known_size = width, height
        return self.known_size

    def check_runnable(self) -> None:
        """Refuse a sequence that no tracker can be started on.

        It reads the image of the first box, unless the size of images is known.

        Raises
        ------
        SequenceError
            Where there is no truth, or where the box that trackers are initialised with
            has no size or lies wholly outside its image.
        """
        frame = self.first_frame
        x, y, width, height = self.boxes[frame].tolist()
        image_width, image_height = self.image_size
        if width <= 0.0 or height <= 0.0:
            fault = "has no size"
        elif lies_outside(self.boxes[frame], (image_width, image_height)):
            fault = f"lies outside the image ({image_width}x{image_height})"
        else:
            return
        raise SequenceError(
            f"{self.truth_source}: the first box, of {self.frame_name(frame)}, {fault}: "
            f"x={x:g} y={y:g} width={width:g} height={height:g} (from 0). Mend it there."
        )

    def mask(self, frame: int) -> Mask | None:
        """Target's pixels in a frame, shape (height, width); None where unknown."""
        return None if self._masks is None else self._masks(frame)

    def frame_name(self, frame: int) -> str:
        """What a reader of a message knows a frame by."""
        return f"frame {frame}" if self._frame_names is None else self._frame_names[frame]

    def _check_reach(self) -> None:
        """Refuse boxes where no image is: areas of such are no numbers."""
        beyond = np.flatnonzero((np.abs(self.boxes) > LARGEST).any(axis=1))
        if len(beyond):
            box = ", ".join(f"{value:g}" for value in self.boxes[beyond[0]])
            raise SequenceError(
                f"{self.truth_source}: the box of {self.frame_name(int(beyond[0]))}, {box}, lies "
                f"beyond {LARGEST:g} pixels, where no image is. Mend it there."
            )

    def _slice(self, index: slice) -> "Sequence":
        chosen = range(len(self))[index]
        numbers = list(chosen)
        masks = self._masks
        return Sequence(
            f"{self.name}[{chosen.start}:{chosen.stop}:{chosen.step}]",
            _Chosen(self.frames, chosen),
            self.boxes[numbers],
            fingerprint=lambda: f"{self.fingerprint}[{chosen.start}:{chosen.stop}:{chosen.step}]",
            regions={key: value[numbers] for key, value in self.regions.items()},
            visibility=self.visibility[numbers],
            attributes={key: value[numbers] for key, value in self.attributes.items()},
            fps=self.fps,
            masks=None if masks is None else lambda frame: masks(chosen[frame]),
            frame_names=[self.frame_name(frame) for frame in numbers],
            truth_source=self.truth_source,
            truth_missing=self.truth_missing,
            image_size=self.known_size,
            values={key: value[numbers] for key, value in self.values.items()},
            origin=self.origin,
            shapes=None if self.shapes is None else self.shapes[index],
        )


def lies_outside(box: ArrayLike, size: tuple[int, int]) -> bool:
    """Whether nothing of a box `[x, y, width, height]` is in an image of this width and height."""
    x, y, width, height = np.asarray(box, np.float64).tolist()
    return bool(x >= size[0] or y >= size[1] or x + width <= 0.0 or y + height <= 0.0)


class _Chosen:
    """Some frames of others, by their numbers."""

    def __init__(self, frames: Frames, chosen: range) -> None:
        self._frames = frames
        self._chosen = chosen

    def __len__(self) -> int:
        return len(self._chosen)

    def __getitem__(self, frame: int) -> Image:
        return self._frames[self._chosen[frame]]


def _column(
    values: NDArray[np.float64], n: int, width: int | None, what: str, name: str
) -> NDArray[np.float64]:
    """Truth of one kind, checked and frozen."""
    shape = (n,) if width is None else (n, width)
    if values.shape != shape:
        raise SequenceError(f"{name}: {what} have shape {values.shape}, not {shape}.")
    column = np.array(values, dtype=np.float64)
    column.flags.writeable = False
    return column


def _flags(values: ArrayLike, n: int, what: str, name: str) -> NDArray[np.bool_]:
    """What is true of each frame, checked and frozen."""
    flags = np.array(values, dtype=np.bool_)
    if flags.shape != (n,):
        raise SequenceError(f"{name}: {what} has shape {flags.shape}, not ({n},).")
    flags.flags.writeable = False
    return flags
