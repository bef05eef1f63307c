"""OpenCV's trackers that need trained models, which the user has as files."""

import hashlib
from collections.abc import Mapping
from math import nan
from pathlib import Path
from typing import Any, ClassVar, Self

import cv2
from pydantic import BaseModel, ConfigDict, Field, model_validator

from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.opencv import OpenCVTracker
from trackmark.trackers.base.parameters import Parameters, TrackerError


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
