"""Image sequence with ground truth, the interface between datasets and other packages."""

import hashlib
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.box_unit import (
    CORNERS,
    find_other_unit,
    resemble_corners,
    share_outside,
)

if TYPE_CHECKING:
    from trackmark.datasets.shapes import Shapes

Array: TypeAlias = NDArray[np.float64]
Image: TypeAlias = NDArray[np.uint8]
Mask: TypeAlias = NDArray[np.bool_]

# maximum absolute coordinate of a ground-truth box [pixels], larger than any image
MAX_COORDINATE = 1e7


_MAX_OUTSIDE = 0.5  # median share of the boxes outside the images above which a remark is made


class SequenceError(ValueError):
    """Error for a sequence that cannot be opened, read or run; its message names the file."""


class UnusableSequencesError(SequenceError):
    """Error for all sequences of a command that cannot be used.

    If there are other sequences, the message says how to go on without these. `remedy` is this
    sentence, and `problem` the message without it.

    Parameters
    ----------
    errors : mapping of str to str
        Messages by the name or path of the sequence.
    n_sequences : int
        Number of all sequences of the command.
    """

    def __init__(self, errors: Mapping[str, str], n_sequences: int) -> None:
        self.errors, self.n_sequences = errors, n_sequences
        lines = list(errors.values())
        if len(errors) > 1:
            lines = [f"{len(errors)} of {n_sequences} sequences cannot be used.", *lines]
        self.problem, self.remedy = "\n".join(lines), ""
        if len(errors) < n_sequences:
            names = ",".join(f"!{name.rstrip('/').rpartition('/')[2]}" for name in errors)
            them = "it" if len(errors) == 1 else "them"
            self.remedy = f"To go on without {them}, add {names} to the sequences."
        super().__init__("\n".join(filter(None, (self.problem, self.remedy))))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.errors, self.n_sequences)


@dataclass(frozen=True)
class SequenceSize:
    """Length and image size of a built-in sequence, known before it is opened.

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
    """Provenance of recorded data; a field is empty if it is unknown.

    Attributes
    ----------
    format : str
        File layout that the reader expects.
    licence : str
        Terms of use.
    citation : str
        Paper to cite.
    description : str
        Target or scene in words, as stated in the data.
    unread_files : tuple of str
        Files with flags per frame, such as `absent.txt`, that the reader of the format ignores.
    other_targets : tuple of str
        Names of the recording's other targets, if no target was selected.
    first_pixel : int
        Coordinate of the first pixel in the files of the data set, and so in result files of its
        toolkits: 0 or 1. `Sequence.boxes` always count from 0.
    """

    format: str = ""
    licence: str = ""
    citation: str = ""
    description: str = ""
    unread_files: tuple[str, ...] = ()
    other_targets: tuple[str, ...] = ()
    first_pixel: int = 0


class Frames(Protocol):
    """Images of a sequence by frame: from a folder, a video file or a renderer."""

    def __len__(self) -> int:
        """Return the number of images."""
        ...

    def __getitem__(self, frame: int) -> Image:
        """Decode or render the image of a frame in `range(len(self))`.

        Frames in order are fastest. Any order gives the same images, all of one size. Raises
        `SequenceError` for an image that cannot be read.
        """
        ...


class Sequence:
    """Images of one target in temporal order, with its ground truth.

    Parameters
    ----------
    name : str
        Canonical name, under which results are stored.
    frames : Frames
        Images. Images after the last ground-truth row are not part of the sequence.
    boxes : array of float64, shape (n, 4), optional
        Ground-truth boxes `[x, y, width, height]` in pixels from 0. In an annotated frame, a NaN
        row means that the target is absent. Without boxes, no frame is annotated: such a sequence
        can be opened and shown, but not evaluated.
    fingerprint : str or callable
        Digest of pixels and ground truth. A callable is called once, at the first access.
    annotated : bool array of shape (n,), optional
        Flags of the frames for which the ground truth states box or absence; by default all. Other
        frames are shown to trackers, but not scored: their boxes and regions become NaN, and they
        have no mask.
    malformed : bool array of shape (n,), optional
        Flags of the frames whose ground truth is a box without size that is not flagged as absence;
        by default none. Their boxes are NaN. Presets of toolkits that score them do so, too.
    regions : mapping of str to array of shape (n, 4), optional
        Further ground-truth boxes by name (`full`, `tight`, …).
    visibility : array of shape (n,), optional
        Visible fraction of the target in [0, 1]; NaN if unknown.
    attributes : mapping of str to bool array of shape (n,), optional
        Flags of the frames with an event, by the name of the event (`occlusion`, …).
    fps : float, optional
        Frame rate [frames/s].
    masks : callable, optional
        Function that returns the mask of a frame, or None if the frame has none.
    frame_names : sequence of str, optional
        Names of the frames in messages, such as file names; `frame i` by default.
    truth_source : str
        File or generator of the ground truth, for messages.
    truth_missing : str
        Sentence that explains why a file that looks like ground truth was not read.
    image_size : tuple of int, optional
        Width and height of the images [pixels], if known without reading an image.
    frame_values : mapping of str to array of shape (n,), optional
        Further numbers per frame, by name (`anchor` of VOT).
    origin : Origin, optional
        Provenance of the data.
    shapes : Shapes, optional
        Polygon or mask of each frame; `boxes` and `regions` enclose them.

    Attributes
    ----------
    frames : Frames
        All images, also those after the last ground-truth row. Indexing the sequence gives only
        the images with a ground-truth row.
    n_unread_images : int
        Number of images after the last ground-truth row.
    known_size : tuple of int or None
        Width and height of the images [pixels] if already known; see `image_size`.

    Raises
    ------
    SequenceError
        If the ground truth does not fit the images: more rows than images, wrong shapes, or
        coordinates beyond any image.
    """

    def __init__(
        self,
        name: str,
        frames: Frames,
        boxes: ArrayLike | None = None,
        *,
        fingerprint: str | Callable[[], str],
        annotated: ArrayLike | None = None,
        malformed: ArrayLike | None = None,
        regions: Mapping[str, ArrayLike] | None = None,
        visibility: ArrayLike | None = None,
        attributes: Mapping[str, ArrayLike] | None = None,
        fps: float | None = None,
        masks: Callable[[int], Mask | None] | None = None,
        frame_names: list[str] | None = None,
        truth_source: str = "",
        truth_missing: str = "",
        image_size: tuple[int, int] | None = None,
        frame_values: Mapping[str, ArrayLike] | None = None,
        origin: Origin | None = None,
        shapes: "Shapes | None" = None,
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
        self._is_runnable = False  # True after a successful `check_runnable`

        n_images = len(frames)
        if n_images == 0:
            raise SequenceError(f"{name}: there are no images.")
        rows = np.full((n_images, 4), np.nan) if boxes is None else np.asarray(boxes, np.float64)
        n = len(rows)
        if n > n_images:
            raise SequenceError(
                f"{self.truth_source}: {n} ground-truth rows for {n_images} images of {name}. "
                "Remove the rows without image, or add the missing images."
            )
        flags = np.full(n, boxes is not None) if annotated is None else annotated
        self.annotated: NDArray[np.bool_] = _frozen(flags, (n,), f"{name}: annotated", np.bool_)
        self.boxes: Array = self._annotated_rows(rows, f"{name}: boxes")
        flags = np.zeros(n, np.bool_) if malformed is None else malformed
        self.malformed: NDArray[np.bool_] = _frozen(flags, (n,), f"{name}: malformed", np.bool_)
        self._check_coordinates()
        self.n_unread_images = n_images - n
        self.regions: dict[str, Array] = {
            key: self._annotated_rows(rows, f"{name}: region {key}")
            for key, rows in (regions or {}).items()
        }
        self.frame_values: dict[str, Array] = {
            key: _frozen(column, (n,), f"{name}: value {key}")
            for key, column in (frame_values or {}).items()
        }
        shares = np.full(n, np.nan) if visibility is None else visibility
        self.visibility: Array = _frozen(shares, (n,), f"{name}: visibility")
        self.attributes: dict[str, NDArray[np.bool_]] = {
            key: _frozen(flags, (n,), f"{name}: attribute {key}", np.bool_)
            for key, flags in (attributes or {}).items()
        }

    def __len__(self) -> int:
        return len(self.boxes)

    @overload
    def __getitem__(self, index: int) -> Image: ...

    @overload
    def __getitem__(self, index: slice) -> "Sequence": ...

    def __getitem__(self, index: int | slice) -> "Image | Sequence":
        """Return the read-only image of a frame, or the sequence of a slice of the frames.

        Raises `SequenceError` for an image that cannot be read, or whose size differs from the
        size of the images read before.
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
                f"{self.name}: {self.frame_name(frame)} has {width}x{height} pixels, other images "
                f"have {expected}. Resize the images to one size, or end the ground truth before "
                "this frame."
            )
        image.flags.writeable = False
        return image

    def __iter__(self) -> Iterator[Image]:
        for frame in range(len(self)):
            yield self[frame]

    def frames_after_init(self) -> Iterator[Image]:
        """Yield the images after the first frame in which the target is present.

        Initialise a tracker with `self[first_frame]` and `boxes[first_frame]`, and update it with
        these images.
        """
        for frame in range(self.first_frame + 1, len(self)):
            yield self[frame]

    @classmethod
    def from_arrays(
        cls,
        frames: Iterable[ArrayLike],
        boxes: ArrayLike,
        *,
        name: str,
        fps: float | None = None,
    ) -> "Sequence":
        """Return a sequence of images in memory.

        Parameters
        ----------
        frames : array of uint8, shape (n, height, width, 3), or list of images of one size
            Images in BGR order. They are not copied: do not change them afterwards.
        boxes : array, shape (n, 4)
            Ground-truth boxes `[x, y, width, height]` in pixels from 0; a NaN row means that the
            target is absent. Frames after the last row are not part of the sequence.
        name : str
            Name, under which results are stored.
        fps : float, optional
            Frame rate [frames/s].

        Returns
        -------
        Sequence
            Its fingerprint is the digest of all pixels and boxes.

        Raises
        ------
        SequenceError
            If there are no frames, if a frame has another type or shape, or if the boxes do not fit
            the frames.
        """
        images = [np.asarray(frame).view() for frame in frames]  # made read-only when they are read
        for frame, image in enumerate(images):
            expected = (*images[0].shape[:2], 3)
            if image.dtype != np.uint8 or image.shape != expected:
                raise SequenceError(
                    f"{name}: frame {frame} is an array of type {image.dtype} and shape "
                    f"{image.shape}. Expected: images of type uint8, of shape (height, width, 3) "
                    "and of one size, with the channels blue, green, red."
                )

        def fingerprint() -> str:
            digest = hashlib.sha256(sequence.boxes.tobytes())
            for image in images:
                digest.update(image.tobytes())
            return digest.hexdigest()

        sequence = cls(name, images, boxes, fingerprint=fingerprint, fps=fps)
        return sequence

    def __repr__(self) -> str:
        return f"<Sequence {self.name}: {len(self)} frames>"

    def _repr_html_(self) -> str:
        """Return name, size, frame rate and the first frame with its box, for a notebook."""
        from trackmark.datasets.film_strip import film_strip  # imported here: it loads OpenCV

        rate = "" if self.fps is None else f", {self.fps:g} frames/s"
        present = self.present.any()
        frame = self.first_frame if present else 0
        height, width = self[frame].shape[:2]
        picture = film_strip([self[frame]], [[self.boxes[frame]]])
        caption = f"{self.name}: {len(self)} frames of {width} × {height} px{rate}"
        return f"<p>{escape(caption)}</p>{picture}"

    @property
    def fingerprint(self) -> str:
        """Digest of all pixels and ground-truth values."""
        if not isinstance(self._fingerprint, str):
            self._fingerprint = self._fingerprint()
        return self._fingerprint

    @property
    def present(self) -> NDArray[np.bool_]:
        """Flags of the frames in which the target is present, shape (n,).

        The target is absent in the other frames that are `annotated`.
        """
        return np.asarray(np.isfinite(self.boxes).all(axis=1))

    @property
    def remarks(self) -> list[str]:
        """Sentences on images, frames, targets and files that are not read or not scored."""
        beyond, unknown = self.n_unread_images, int((~self.annotated).sum())
        remarks = []
        if beyond:
            images = "1 image" if beyond == 1 else f"{beyond} images"
            remarks.append(f"ignored {images} after the ground truth.")
        if 0 < unknown < len(self):
            remarks.append(f"{unknown} of {len(self)} frames are not annotated and not scored.")
        if n := int(self.malformed.sum()):
            first = self.frame_name(int(self.malformed.argmax()))
            remarks.append(
                f"{n} row{'s' * (n > 1)} of the ground truth without a positive size (first for "
                f"{first}) stand{'s' * (n == 1)} for absence; the metrics lasot and got10k score "
                "such rows as their toolkits do."
            )
        if self.known_size is not None and self.present.any():
            outside = share_outside(self.boxes[self.present], self.known_size)
            if problem := self._unit_problem(self.known_size):
                remarks.append(problem)
            elif resemble_corners(self.boxes, self.known_size):
                remarks.append(
                    f"the ground truth can be {CORNERS.name}. Expected: x, y, width, height. "
                    "Look at the boxes (`trackmark show`). If they are wrong, convert all rows: "
                    f"{CORNERS.remedy}."
                )
            elif np.median(outside) > _MAX_OUTSIDE:
                remarks.append(
                    "most boxes lie outside the images. Check that the ground truth is in pixels "
                    "of images of this size."
                )
        if other_targets := self.origin.other_targets:
            n = len(other_targets)
            subject = "1 other target is" if n == 1 else f"{n} other targets are"
            remarks.append(
                f"{subject} not used, for example {other_targets[0]}. A folder or a pattern "
                "selects all targets of a recording."
            )
        if self.origin.unread_files:
            files = ", ".join(self.origin.unread_files)
            remarks.append(
                f"{files} is not read: this format defines no such flags. If the target is absent "
                "in the flagged frames, write empty boxes into a ground-truth file (--truth)."
            )
        return remarks

    @property
    def first_frame(self) -> int:
        """First frame in which the target is present; trackers are initialised there.

        Raises
        ------
        SequenceError
            If the sequence has no ground truth.
        """
        present = np.flatnonzero(self.present)
        if len(present) == 0:
            missing = f" {self.truth_missing}" if self.truth_missing else ""
            raise SequenceError(
                f"{self.name}: there is no ground truth, so no tracker can be initialised or "
                f"scored.{missing} Provide a ground-truth file (--truth FILE, CSV with columns "
                "frame,x,y,width,height), or draw boxes: `trackmark annotate PATH --draw`."
            )
        return int(present[0])

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of the images [pixels]; reads an image if the size is unknown.

        Raises `SequenceError` if there is no ground truth, or if that image cannot be read.
        """
        if self.known_size is None:
            height, width = self[self.first_frame].shape[:2]
            self.known_size = width, height
        return self.known_size

    def check_runnable(self) -> None:
        """Check that a tracker can be initialised on the sequence.

        It reads the image of the first box, unless the image size is known.

        Raises
        ------
        SequenceError
            If there is no ground truth, if its rows cannot be boxes in pixels, or if the init box
            has no size or lies completely outside its image.
        """
        if self._is_runnable:
            return
        frame = self.first_frame
        x, y, width, height = self.boxes[frame].tolist()
        image_width, image_height = self.image_size
        if problem := self._unit_problem(self.image_size):
            raise SequenceError(f"{self.truth_source}: {problem}")
        if width <= 0.0 or height <= 0.0:
            problem = "has no size"
        elif lies_outside(self.boxes[frame], (image_width, image_height)):
            problem = f"lies outside the image ({image_width}x{image_height})"
        else:
            self._is_runnable = True
            return
        raise SequenceError(
            f"{self.truth_source}: the first box, of {self.frame_name(frame)}, {problem}: "
            f"x={x:g} y={y:g} width={width:g} height={height:g} (from 0). Correct it in the file."
        )

    def mask(self, frame: int) -> Mask | None:
        """Return the target's pixels in a frame, shape (height, width), or None if unknown."""
        return None if self._masks is None or not self.annotated[frame] else self._masks(frame)

    def frame_name(self, frame: int) -> str:
        """Return the name of a frame in messages: its file name, or `frame i`."""
        return f"frame {frame}" if self._frame_names is None else self._frame_names[frame]

    def _unit_problem(self, size: tuple[int, int]) -> str:
        """Return why the ground truth cannot be boxes in pixels of such images; empty if it can."""
        unit = find_other_unit(self.boxes, size)
        if unit is None:
            return ""
        x, y, width, height = self.boxes[self.first_frame].tolist()
        return (
            f"the ground truth looks like {unit.name}; the box of "
            f"{self.frame_name(self.first_frame)} is {x:g}, {y:g}, {width:g}, {height:g} (from 0) "
            f"in an image of {size[0]}x{size[1]}. Expected: x, y, width, height in pixels. Convert "
            f"all rows: {unit.remedy}."
        )

    def _annotated_rows(self, rows: ArrayLike, label: str) -> Array:
        """Return boxes as a read-only array, with NaN rows in frames that are not annotated."""
        array = np.array(_frozen(rows, (len(self.annotated), 4), label))
        array[~self.annotated] = np.nan
        array.flags.writeable = False
        return array

    def _check_coordinates(self) -> None:
        """Check that no coordinate exceeds MAX_COORDINATE, so that box areas cannot overflow."""
        too_large = np.flatnonzero((np.abs(self.boxes) > MAX_COORDINATE).any(axis=1))
        if len(too_large):
            box = ", ".join(f"{value:g}" for value in self.boxes[too_large[0]])
            raise SequenceError(
                f"{self.truth_source}: the box of {self.frame_name(int(too_large[0]))}, {box}, has "
                f"a coordinate beyond {MAX_COORDINATE:g} pixels. Correct it in the file."
            )

    def _slice(self, index: slice) -> "Sequence":
        selection = range(len(self))[index]
        frames = list(selection)
        masks = self._masks
        label = f"[{selection.start}:{selection.stop}:{selection.step}]"
        return Sequence(
            f"{self.name}{label}",
            _FrameSelection(self.frames, selection),
            self.boxes[frames],
            fingerprint=lambda: f"{self.fingerprint}{label}",
            annotated=self.annotated[frames],
            malformed=self.malformed[frames],
            regions={key: rows[frames] for key, rows in self.regions.items()},
            visibility=self.visibility[frames],
            attributes={key: flags[frames] for key, flags in self.attributes.items()},
            fps=self.fps,
            masks=None if masks is None else lambda frame: masks(selection[frame]),
            frame_names=[self.frame_name(frame) for frame in frames],
            truth_source=self.truth_source,
            truth_missing=self.truth_missing,
            image_size=self.known_size,
            frame_values={key: column[frames] for key, column in self.frame_values.items()},
            origin=self.origin,
            shapes=None if self.shapes is None else self.shapes[index],
        )


def group_remarks(sequences: Iterable[tuple[str, Collection[str]]]) -> list[str]:
    """Return the remarks on several sequences, each with the name of its sequence.

    `sequences` are names and remarks. Of remarks that differ only in their numbers, the first one
    is returned, with their number.
    """
    by_pattern: dict[str, list[str]] = {}
    for name, remarks in sequences:
        for remark in remarks:
            pattern = re.sub(r"\d+", "", remark)
            by_pattern.setdefault(pattern, []).append(f"{name}: {remark}")
    return [
        first + (f" {len(similar)} more sequences like this." if similar else "")
        for first, *similar in by_pattern.values()
    ]


def lies_outside(box: ArrayLike, size: tuple[int, int]) -> bool:
    """Return whether a box `[x, y, width, height]` lies outside an image of this width, height."""
    x, y, width, height = np.asarray(box, np.float64).tolist()
    return bool(x >= size[0] or y >= size[1] or x + width <= 0.0 or y + height <= 0.0)


class _FrameSelection:
    """Frames that are selected from other frames."""

    def __init__(self, frames: Frames, selection: range) -> None:
        self._frames = frames
        self._selection = selection

    def __len__(self) -> int:
        return len(self._selection)

    def __getitem__(self, frame: int) -> Image:
        return self._frames[self._selection[frame]]


def _frozen(
    values: ArrayLike, shape: tuple[int, ...], label: str, dtype: type = np.float64
) -> NDArray[Any]:
    """Return a read-only copy of a ground-truth array after a check of its shape."""
    array: NDArray[Any] = np.array(values, dtype=dtype)
    if array.shape != shape:
        raise SequenceError(f"{label}: the shape is {array.shape}. Expected: {shape}.")
    array.flags.writeable = False
    return array


@dataclass(frozen=True)
class SequenceMetadata:
    """Metadata of a sequence, as shown by `trackmark describe`.

    Attributes
    ----------
    name : str
        Canonical name.
    length : int
        Number of frames.
    size : tuple of int
        Width and height of the images [pixels].
    fps : float or None
        Frame rate [frames/s].
    present : int
        Number of frames in which the target is present; 0 without ground truth.
    annotated : int
        Number of frames for which the ground truth states box or absence; others are not scored.
    regions : list of str
        Names of further ground-truth boxes.
    attributes : mapping of str to int
        Number of frames with an event (`occlusion`, …), for events that occur.
    truth_source : str
        File or generator of the ground truth.
    n_unread_images : int
        Number of images after the last ground-truth row; they are not read.
    fingerprint : str
        See `Sequence.fingerprint`.
    remarks : tuple of str
        See `Sequence.remarks`.
    truth_missing : str
        Reason why a file that looks like ground truth was not read, or an empty text.
    origin : Origin
        Provenance of recorded data.
    """

    name: str
    length: int
    size: tuple[int, int]
    fps: float | None
    present: int
    annotated: int
    regions: list[str]
    attributes: Mapping[str, int]
    truth_source: str
    n_unread_images: int
    fingerprint: str
    remarks: tuple[str, ...] = ()
    truth_missing: str = ""
    origin: Origin = field(default_factory=Origin)


def stored_metadata(sequence: Sequence) -> dict[str, Any]:
    """Return the fields of `SequenceMetadata` that `golden.json` stores, as JSON values."""
    return {
        "fps": sequence.fps,
        "present": int(sequence.present.sum()),
        "regions": list(sequence.regions),
        "attributes": {
            name: int(flags.sum()) for name, flags in sequence.attributes.items() if flags.any()
        },
    }


def sequence_metadata(sequence: Sequence, size: tuple[int, int] | None = None) -> SequenceMetadata:
    """Return the metadata of an opened sequence; without `size`, the first image is read."""
    if size is None:
        height, width = sequence[0].shape[:2]
        size = width, height
    return SequenceMetadata(
        name=sequence.name,
        length=len(sequence),
        size=size,
        annotated=int(sequence.annotated.sum()),
        truth_source=sequence.truth_source,
        truth_missing=sequence.truth_missing,
        n_unread_images=sequence.n_unread_images,
        fingerprint=sequence.fingerprint,
        remarks=tuple(sequence.remarks),
        origin=sequence.origin,
        **stored_metadata(sequence),
    )
