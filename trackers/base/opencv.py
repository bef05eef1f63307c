"""One adapter for all of OpenCV's trackers, with or without trained models that the user has."""

import ctypes
import hashlib
from collections.abc import Callable, Mapping
from math import floor, nan
from pathlib import Path
from typing import Any, ClassVar, Self

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from trackmark.trackers.base.interface import (
    Box,
    Estimate,
    Image,
    Mask,
    Randomness,
    TrackerPlugin,
    four_numbers,
)
from trackmark.trackers.base.parameters import Parameters, TrackerError

CONTRIBUTED = "install opencv-contrib-python-headless in place of opencv-python-headless"


def factory(name: str, remedy: str = CONTRIBUTED) -> Callable[..., Any]:
    """Return `cv2.Tracker<name>_create`, or `cv2.legacy`'s; ImportError with what helps."""
    for module in (cv2, getattr(cv2, "legacy", None)):
        create = getattr(module, f"Tracker{name}_create", None)
        if create is not None:
            return create  # type: ignore[no-any-return]  # OpenCV's stubs know only some of them
    raise ImportError(f"the installed OpenCV {cv2.__version__} has no Tracker{name}; {remedy}.")


def with_read_parameters(tracker: Any, values: Mapping[str, object]) -> Any:
    """Give a tracker of `cv2.legacy` parameters that Python has no `Params` for, by its `read`."""
    lines = ["%YAML:1.0", "---", *(f"{name}: {value}" for name, value in values.items()), ""]
    storage = cv2.FileStorage("\n".join(lines), cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    tracker.read(storage.root())
    return tracker


def pixel_rectangle(box: Box, image: Image) -> tuple[int, int, int, int]:
    """Return x, y, width, height of the pixels that a box covers; TrackerError for none."""
    height, width = image.shape[:2]
    x, y, wide, high = four_numbers(box)
    right, bottom = x + wide, y + high
    if x >= width or y >= height or right <= 0 or bottom <= 0:
        raise TrackerError(
            f"the first box {np.round(box, 1).tolist()} lies outside the image "
            f"of {width} x {height} pixels."
        )
    left, columns = _pixels(x, right, width)
    top, rows = _pixels(y, bottom, height)
    return left, top, columns, rows


def _pixels(start: float, end: float, n_pixels: int) -> tuple[int, int]:
    """First pixel of an axis between two edges, and their number."""
    first = min(max(floor(start + 0.5), 0), n_pixels - 1)
    return first, min(max(floor(end + 0.5), first + 1), n_pixels) - first


class OpenCVParameters(Parameters):
    """Parameters that a tracker of OpenCV's was given after results had been kept.

    Attributes
    ----------
    implied : bool
        Whether a run is identified without parameters that have their defaults, as it was before
        there were any.
    """

    implied: ClassVar[bool] = True


class OpenCVTracker(TrackerPlugin):
    """A tracker of OpenCV's behind our interface.

    It is handed the first box as whole pixels inside the image. Where it says that it lost
    the target, or returns a box without area, the estimate is the last good box and not
    visible.

    A name alone means OpenCV's defaults, the preset `opencv`; `recommended` is what the method's
    authors published where OpenCV departs from it.

    Attributes
    ----------
    create_tracker : callable
        Makes OpenCV's object; see `factory`.
    opencv_parameters : str
        Name in `cv2` of the parameters that it takes; empty where it takes none.
    smallest_side : int
        Least width and height of the first box, in pixels: below it OpenCV's `init` fails
        or never returns (found by experiment with OpenCV 4.14 and 5.0).
    """

    default_preset: ClassVar[str] = "opencv"
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"opencv": {}, "recommended": {}}
    create_tracker: ClassVar[Callable[..., Any]]
    opencv_parameters: ClassVar[str] = ""
    smallest_side: ClassVar[int] = 1

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raises TrackerError for a box outside, too small or refused."""
        rectangle = pixel_rectangle(box, image)
        if min(rectangle[2:]) < self.smallest_side:
            raise TrackerError(
                f"{type(self).__name__} needs a first box of at least {self.smallest_side} x "
                f"{self.smallest_side} pixels inside the image, not "
                f"{rectangle[2]} x {rectangle[3]}."
            )
        self._tracker = self._make()
        try:
            if self.randomness is Randomness.PROCESS:
                self._seed_process()
            self._tracker.init(image, rectangle)
            if self.randomness is Randomness.PROCESS:
                # Boosting's init seeds the process itself, always alike.
                self._seed_process()
        except cv2.error as error:
            raise TrackerError(
                f"OpenCV's {type(self).__name__} refuses the first box {rectangle} in an image "
                f"of {image.shape[1]} x {image.shape[0]} pixels: {error.err}"
            ) from error
        self._box = np.array(box, dtype=np.float64)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        found, rectangle = self._tracker.update(image)
        box = np.array(rectangle, dtype=np.float64)
        good = bool(found and np.isfinite(box).all() and (box[2:] > 0).all())
        if good:
            self._box = box
        return Estimate(self._box.copy(), visible=good)

    def _make(self) -> Any:
        """OpenCV's object, with its parameters."""
        if not self.opencv_parameters:
            return type(self).create_tracker()
        parameters = getattr(cv2, self.opencv_parameters)()
        for name, value in self._opencv_values().items():
            if not hasattr(parameters, name):
                raise TrackerError(
                    f"the installed OpenCV {cv2.__version__} has no {name} among its "
                    f"{self.opencv_parameters}; install a newer one."
                )
            setattr(parameters, name, value)
        return type(self).create_tracker(parameters)

    def _opencv_values(self) -> dict[str, Any]:
        """OpenCV's parameters by its own names."""
        return dict(self.parameters)

    def _seed_process(self) -> None:
        """Seed both generators that OpenCV's trackers draw from: libc's `rand` and its own."""
        libc_seed, opencv_seed = self.seed.generate_state(2).tolist()
        ctypes.CDLL(None).srand(ctypes.c_uint(libc_seed))
        cv2.setRNGSeed(opencv_seed >> 1)  # takes a signed 32-bit integer


class ModelFile(BaseModel):
    """A parameter: a file with a trained model.

    In text it is the file's name. A run's identity holds the digest of what is in it, so that
    another model under the same name makes other runs.
    """

    model_config = ConfigDict(frozen=True)

    file: str
    sha256: str

    @model_validator(mode="before")
    @classmethod
    def _read(cls, given: Any) -> Any:
        if not isinstance(given, str | Path):
            return given
        try:
            with Path(given).expanduser().open("rb") as content:
                digest = hashlib.file_digest(content, "sha256").hexdigest()
        except (OSError, ValueError) as error:  # ValueError: a null byte in the name
            said = getattr(error, "strerror", None) or str(error)
            raise ValueError(f"the file can't be read ({said})") from None
        return {"file": str(given), "sha256": digest}

    def __str__(self) -> str:
        return self.file


def model_file(meaning: str) -> Any:
    """Field of a model file, which has to be given; `meaning` says where such files come from."""
    return Field(description=meaning)


class ModelParameters(Parameters):
    """Parameters with model files: what is wrong with one is said with where it comes from."""

    @classmethod
    def checked(cls, owner: str, values: Mapping[str, Any]) -> Self:
        """See `Parameters.checked`."""
        for name, field in cls.model_fields.items():
            if field.annotation is ModelFile and not values.get(name):
                raise TrackerError(
                    f"{owner}: parameter {name} has to be given, as in {owner}:{name}=PATH: "
                    f"{field.description}."
                )
        try:
            return super().checked(owner, values)
        except TrackerError as error:
            name = str(error).removeprefix(f"{owner}: parameter ").partition("=")[0]
            about = cls.model_fields.get(name)
            if about is None or about.annotation is not ModelFile:
                raise
            said = str(error).replace("Value error, ", "")
            raise TrackerError(f"{said} It has to be the {about.description}.") from None


class ModelTracker(OpenCVTracker):
    """A tracker of OpenCV's that runs trained models.

    Its confidence is OpenCV's score, where that is one. OpenCV's code fails where the part of the
    image that it wants to look at lies outside; the target then counts as not visible.
    """

    default_preset = "recommended"
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {}

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raises TrackerError for models that can't be used, too."""
        self._worked = False
        try:
            super().init(image, box, mask)
        except TrackerError as error:
            if not isinstance(error.__cause__, cv2.error):
                raise
            raise TrackerError(f"{error}. Its models are {self._files()}.") from error.__cause__

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`; raises TrackerError where the models don't do what they should."""
        try:
            estimate = super().update(image)
        except cv2.error as error:
            if not self._worked:
                raise TrackerError(self._unusable(error)) from error
            return Estimate(self._box.copy(), visible=False)
        self._worked = True
        told = getattr(self._tracker, "getTrackingScore", None)  # GOTURN has none
        score = float(told()) if told else nan
        return Estimate(estimate.box, estimate.visible, score if 0 <= score <= 1 else nan)

    def _opencv_values(self) -> dict[str, Any]:
        return {
            name: str(Path(value.file).expanduser()) if isinstance(value, ModelFile) else value
            for name, value in self.parameters
        }

    def _make(self) -> Any:
        # OpenCV warns at each new tracker of what it does not support, whatever is asked for.
        level = cv2.utils.logging.getLogLevel()
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
        try:
            return super()._make()
        except cv2.error as error:
            raise TrackerError(self._unusable(error)) from None
        finally:
            cv2.utils.logging.setLogLevel(level)

    def _unusable(self, error: cv2.error) -> str:
        said = " ".join(str(error.err).split())[:300]
        return (
            f"OpenCV {cv2.__version__} can't use the models of {type(self).__name__}, "
            f"{self._files()}: {said}."
        )

    def _files(self) -> str:
        files = (item for item in self.parameters if isinstance(item[1], ModelFile))
        return ", ".join(f"{name}={value}" for name, value in files)
