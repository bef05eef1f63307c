"""Boxes that a user draws on key frames, and the files in which they are kept.

Several tabs and several programs can work on the same files. `DrawingFiles` remembers the content
that it last read or wrote, and replaces no other content.
"""

import hashlib
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, Field, ValidationError

from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.output_files import write_file
from trackmark.datasets import SequenceError

_CONTINUE = "Reload this page to continue from them; new changes in this tab are not kept."


class Drawing(BaseModel):
    """Boxes `[x, y, width, height]` of key frames [pixels], and intervals without the target."""

    boxes: dict[int, Annotated[list[float], Field(min_length=4, max_length=4)]] = {}
    absent: list[tuple[int, int]] = []  # first and last frame, both included


class _Draft(Drawing):
    """Unsaved changes of a drawing."""

    video: str = ""  # see `DrawingFiles`; empty if unknown


class ConflictError(ValueError):
    """Refusal to overwrite boxes that another tab or another program has changed."""


class DrawingFiles:
    """Ground-truth file `target` and its file of unsaved changes, `draft`.

    `saved`: content of `target`; `drawing`: boxes with the unsaved changes; `version`: number of
    changes of both. `video`: name, number of frames and size of the video. `check` raises
    `SequenceError` for a drawing that does not fit the video; `read` returns the content of
    `target`; `write` replaces it.
    """

    def __init__(
        self,
        target: Path,
        video: str,
        *,
        check: Callable[[Drawing], object],
        read: Callable[[], Drawing],
        write: Callable[[Drawing], object],
    ) -> None:
        self.target, self.video = target, video
        self.draft = target.with_name(f"{target.name}.draft")
        self.saved = self.drawing = Drawing()
        self.version = 0
        self._check, self._read, self._write = check, read, write
        self._digests: dict[Path, str | None] = {target: None, self.draft: None}  # known contents
        self._lock = threading.Lock()

    def load(self, added: Drawing, *, replace: bool) -> str:
        """Read both files and add a drawing; return a note for the user, or an empty text.

        `replace`: do not load the present boxes of the files. Raises `SequenceError` or
        `ExperimentError` if the boxes of the file or the added boxes do not fit the video.
        """
        note = ""
        if replace:
            self._digests = {file: _digest(file) for file in self._digests}
        else:
            note = self._read_draft()
            self._read_target()
        boxes, absent = self.drawing.boxes | added.boxes, self.drawing.absent + added.absent
        drawing = Drawing(boxes=boxes, absent=absent)
        self._check(drawing)
        self.drawing = drawing
        return note

    def reload(self) -> str:
        """Read files that another program has changed; return a note for the user, or "".

        Raises `OSError`, `SequenceError` or `ExperimentError` if a changed file cannot be read.
        """
        with self._lock:
            notes = []
            if not self._is_known(self.target):
                self._read_target()
                notes.append(
                    f"Another program has changed {self.target.name}. Save replaces it with the "
                    "boxes shown; Revert shows the boxes of the file."
                )
                self.version += 1
            if not self._is_known(self.draft):
                notes.append(self._read_draft())
                self.version += 1
            return " ".join(filter(None, notes))

    def keep(self, drawing: Drawing, action: str, version: str | None = None) -> str:
        """Write the draft, or with another action the file itself; return a message for the user.

        `version`: version on which the drawing is based; None to replace any.

        Raises
        ------
        ConflictError
            If another tab or another program has changed the boxes.
        OSError, ValueError
            If a file cannot be written, or the drawing does not fit the video.
        """
        with self._lock:
            is_draft = action == "draft"
            if version not in (None, str(self.version)):
                raise ConflictError(f"another tab has changed the boxes. {_CONTINUE}")
            if is_draft and not self._is_known(self.draft):
                raise ConflictError(
                    f"another program has changed the boxes in {self.draft.name}. {_CONTINUE}"
                )
            if not is_draft and not self._is_known(self.target):
                raise ConflictError(
                    f"another program has changed {self.target.name}. Reload this page to choose "
                    "between its boxes and yours."
                )
            self._check(drawing)
            if not is_draft:
                self._write(drawing)
                self._digests[self.target], self.saved = _digest(self.target), drawing
            self._write_draft(drawing)
            self.drawing = self.saved if drawing == self.saved else drawing
            self.version += 1
        if is_draft:
            return ""
        end = ". You can close this page" if action == "finish" else ""
        return f"Saved {len(drawing.boxes)} key frames to {self.target.name}{end}."

    def _is_known(self, file: Path) -> bool:
        """Return whether a file is missing or has the content that was last read or written."""
        return _digest(file) in (None, self._digests[file])

    def _read_target(self) -> None:
        """Read the ground-truth file, if it exists."""
        digest = _digest(self.target)
        if digest is None:
            return
        saved = self._read()
        try:
            self._check(saved)
        except SequenceError as error:
            raise SequenceError(
                f"{self.target}: {error} If this file belongs to another video, give a new file "
                "with --output."
            ) from error
        if self.drawing is self.saved:  # no unsaved changes
            self.drawing = saved
        self._digests[self.target], self.saved = digest, saved

    def _read_draft(self) -> str:
        """Read the unsaved changes; return a note if they belong to another video."""
        digest = _digest(self.draft)
        if digest is None:
            return ""
        try:
            draft = _Draft.model_validate_json(self.draft.read_bytes())
        except ValidationError:
            raise ExperimentError(
                f"{self.draft}: not a draft of annotate. Delete the file."
            ) from None
        drawing = Drawing(boxes=draft.boxes, absent=draft.absent)
        if not self._fits(draft.video, drawing):
            return self._set_draft_aside(draft.video)
        self._digests[self.draft], self.drawing = digest, drawing
        return ""

    def _fits(self, video: str, drawing: Drawing) -> bool:
        """Return whether a drawing belongs to the video."""
        if video not in ("", self.video):
            return False
        try:
            self._check(drawing)
        except SequenceError:
            return False
        return True

    def _set_draft_aside(self, video: str) -> str:
        """Rename the draft of another video, so that it is not lost; return a note."""
        suffix = 1
        while (other := self.draft.with_name(f"{self.draft.name}.{suffix}")).exists():
            suffix += 1
        self.draft.rename(other)
        owner = f"another video ({video})" if video else "another video"
        return (
            f"{self.draft}: unsaved boxes of {owner}, not of {self.video}. They are not loaded; "
            f"the file is now {other.name}."
        )

    def _write_draft(self, drawing: Drawing) -> None:
        """Write unsaved changes; without any, remove the draft, except that of another program."""
        if drawing != self.saved:
            content = _Draft(**drawing.model_dump(), video=self.video).model_dump_json()
            write_file(self.draft, content.encode(errors="replace"))
            self._digests[self.draft] = _digest(self.draft)
        elif self._is_known(self.draft):
            self.draft.unlink(missing_ok=True)


def _digest(file: Path) -> str | None:
    """Return a digest of a file's content, None if there is no such file."""
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except FileNotFoundError:
        return None
