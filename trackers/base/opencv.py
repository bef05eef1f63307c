"""Base classes that adapt OpenCV's trackers, with or without trained models."""

import ctypes
import hashlib
from collections.abc import Callable, Mapping
from math import floor, nan
from pathlib import Path
from typing import Any, ClassVar, Self

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, model_validator

from trackmark.trackers.base.interface import (
    Box,
    Estimate,
    Image,
    Mask,
    Randomness,
    TrackerPlugin,
    check_box,
)
from trackmark.trackers.base.parameters import Parameters, TrackerError

CONTRIBUTED = "run `pip install --force-reinstall --no-deps opencv-contrib-python-headless`"


def find_factory(name: str, remedy: str = CONTRIBUTED) -> Callable[..., Any]:
    """Return `Tracker<name>_create` of `cv2` or `cv2.legacy`; raise ImportError with `remedy`."""
    for module in (cv2, getattr(cv2, "legacy", None)):
        create = getattr(module, f"Tracker{name}_create", None)
        if create is not None:
            return create  # type: ignore[no-any-return]  # OpenCV's stubs know only some of them
    raise ImportError(f"the installed OpenCV {cv2.__version__} has no Tracker{name}; {remedy}.")


def set_legacy_parameters(tracker: Any, values: Mapping[str, object]) -> Any:
    """Set parameters of a `cv2.legacy` tracker that has no `Params` class, by its method `read`."""
    lines = ["%YAML:1.0", "---", *(f"{name}: {value}" for name, value in values.items()), ""]
    storage = cv2.FileStorage("\n".join(lines), cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    tracker.read(storage.root())
    return tracker


def pixel_rectangle(box: Box, image: Image) -> tuple[int, int, int, int]:
    """Return x, y, width, height of a box in whole pixels inside the image.

    Raises TrackerError if the box lies outside the image.
    """
    height, width = image.shape[:2]
    x, y, wide, high = check_box(box)
    right, bottom = x + wide, y + high
    if x >= width or y >= height or right <= 0 or bottom <= 0:
        raise TrackerError(
            f"the init box {np.round(box, 1).tolist()} lies outside the image of {width} x "
            f"{height} pixels. Use another box."
        )
    left, columns = _pixels(x, right, width)
    top, rows = _pixels(y, bottom, height)
    return left, top, columns, rows


def _pixels(start: float, end: float, n_pixels: int) -> tuple[int, int]:
    """Return the first pixel between two edges on an axis, and the number of pixels."""
    first = min(max(floor(start + 0.5), 0), n_pixels - 1)
    return first, min(max(floor(end + 0.5), first + 1), n_pixels) - first


class OpenCVTracker(TrackerPlugin):
    """Base class of OpenCV's trackers.

    The init box is rounded to whole pixels inside the image. If OpenCV reports that the target is
    lost, or returns a box without area, the estimate is the last valid box, not visible.

    The default preset `opencv` has OpenCV's default values. If OpenCV's values differ from those of
    the method's authors, `recommended` has the authors' values.

    Attributes
    ----------
    create_tracker : callable
        Function that creates OpenCV's tracker; see `find_factory`.
    opencv_parameters : str
        Name of the tracker's parameter class in `cv2`; empty if it has none.
    smallest_side : int
        Minimum width and height of the init box [pixels]. For a smaller box, OpenCV's `init` fails
        or never returns (measured with OpenCV 4.14 and 5.0).
    """

    default_preset: ClassVar[str] = "opencv"
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"opencv": {}, "recommended": {}}
    create_tracker: ClassVar[Callable[..., Any]]
    opencv_parameters: ClassVar[str] = ""
    smallest_side: ClassVar[int] = 1

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raise TrackerError if the box is outside, too small or rejected."""
        rectangle = pixel_rectangle(box, image)
        if min(rectangle[2:]) < self.smallest_side:
            raise TrackerError(
                f"{type(self).__name__} needs an init box with at least {self.smallest_side} x "
                f"{self.smallest_side} pixels inside the image, not {rectangle[2]} x "
                f"{rectangle[3]}."
            )
        self._tracker = self._make()
        try:
            if self.randomness is Randomness.PROCESS:
                self._seed_process()
            self._tracker.init(image, rectangle)
            if self.randomness is Randomness.PROCESS:
                # Boosting's `init` seeds the process with a constant.
                self._seed_process()
        except cv2.error as error:
            raise TrackerError(
                f"OpenCV's {type(self).__name__} rejects the init box {rectangle} in an image "
                f"of {image.shape[1]} x {image.shape[0]} pixels: {error.err}"
            ) from error
        self._box = np.array(box, dtype=np.float64)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        tracked, rectangle = self._tracker.update(image)
        box = np.array(rectangle, dtype=np.float64)
        good = bool(tracked and np.isfinite(box).all() and (box[2:] > 0).all())
        if good:
            self._box = box
        return Estimate(self._box.copy(), visible=good)

    def _make(self) -> Any:
        """Create OpenCV's tracker with its parameters."""
        if not self.opencv_parameters:
            return type(self).create_tracker()
        parameters = getattr(cv2, self.opencv_parameters)()
        for name, value in self._opencv_values().items():
            if not hasattr(parameters, name):
                raise TrackerError(
                    f"the installed OpenCV {cv2.__version__} has no parameter {name} in "
                    f"{self.opencv_parameters}. Install a newer version."
                )
            setattr(parameters, name, value)
        return type(self).create_tracker(parameters)

    def _opencv_values(self) -> dict[str, Any]:
        """Return the parameters by OpenCV's names."""
        return dict(self.parameters)

    def _seed_process(self) -> None:
        """Seed the two generators that OpenCV's trackers use: libc's `rand` and OpenCV's own."""
        libc_seed, opencv_seed = self.seed.generate_state(2).tolist()
        ctypes.CDLL(None).srand(ctypes.c_uint(libc_seed))
        cv2.setRNGSeed(opencv_seed >> 1)  # the argument is a signed 32-bit integer


class ModelFile(BaseModel):
    """Parameter value: a file with a trained model.

    As text, the value is the file name. A run's identity includes the digest of the file's content,
    because different models can have the same file name.
    """

    model_config = ConfigDict(frozen=True)

    file: str
    sha256: str

    @model_validator(mode="before")
    @classmethod
    def _read(cls, value: Any) -> Any:
        if not isinstance(value, str | Path):
            return value
        try:
            with Path(value).expanduser().open("rb") as model_file:
                digest = hashlib.file_digest(model_file, "sha256").hexdigest()
        except (OSError, ValueError) as error:  # ValueError: a null byte in the name
            reason = getattr(error, "strerror", None) or str(error)
            raise ValueError(f"the file cannot be read ({reason})") from None
        return {"file": str(value), "sha256": digest}

    def __str__(self) -> str:
        return self.file


class ModelFileParameters(Parameters):
    """Parameters with model files; errors about a file state where to get it."""

    @classmethod
    def checked(cls, owner: str, values: Mapping[str, Any]) -> Self:
        """See `Parameters.checked`."""
        for name, field in cls.model_fields.items():
            if field.annotation is ModelFile and not values.get(name):
                raise TrackerError(
                    f"{owner}: the parameter {name} is missing. Set it by {owner}:{name}=PATH. "
                    "Expected: "
                    f"{field.description}."
                )
        try:
            return super().checked(owner, values)
        except TrackerError as error:
            name = str(error).removeprefix(f"{owner}: parameter ").partition("=")[0]
            field_info = cls.model_fields.get(name)
            if field_info is None or field_info.annotation is not ModelFile:
                raise
            message = str(error).replace("Value error, ", "")
            raise TrackerError(f"{message} Expected: {field_info.description}.") from None


class ModelFileTracker(OpenCVTracker):
    """Base class of OpenCV's trackers with trained models.

    The confidence is OpenCV's score if it is in [0, 1], otherwise NaN. OpenCV raises an error if
    its search region lies outside the image; the estimate is then the last box, not visible.
    """

    default_preset = "recommended"
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {}

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `OpenCVTracker.init`; raise TrackerError also if OpenCV cannot use the models."""
        self._has_updated = False
        try:
            super().init(image, box, mask)
        except TrackerError as error:
            if not isinstance(error.__cause__, cv2.error):
                raise
            message = f"{error}. Its models are {self._model_files_text()}."
            raise TrackerError(message) from error.__cause__

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`; raise TrackerError if the models fail in the first update."""
        try:
            estimate = super().update(image)
        except cv2.error as error:
            if not self._has_updated:
                raise TrackerError(self._model_error_text(error)) from error
            return Estimate(self._box.copy(), visible=False)
        self._has_updated = True
        get_score = getattr(self._tracker, "getTrackingScore", None)  # GOTURN has no score
        score = float(get_score()) if get_score else nan
        return Estimate(estimate.box, estimate.visible, score if 0 <= score <= 1 else nan)

    def _opencv_values(self) -> dict[str, Any]:
        return {
            name: str(Path(value.file).expanduser()) if isinstance(value, ModelFile) else value
            for name, value in self.parameters
        }

    def _make(self) -> Any:
        # OpenCV logs a warning about unsupported backends for each new tracker.
        level = cv2.utils.logging.getLogLevel()
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
        try:
            return super()._make()
        except cv2.error as error:
            raise TrackerError(self._model_error_text(error)) from None
        finally:
            cv2.utils.logging.setLogLevel(level)

    def _model_error_text(self, error: cv2.error) -> str:
        message = " ".join(str(error.err).split())[:300]
        return (
            f"OpenCV {cv2.__version__} cannot use the models of {type(self).__name__}, "
            f"{self._model_files_text()}: {message}."
        )

    def _model_files_text(self) -> str:
        files = (item for item in self.parameters if isinstance(item[1], ModelFile))
        return ", ".join(f"{name}={value}" for name, value in files)
