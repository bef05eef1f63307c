"""Parameters of trackers: declaration, validation and error messages."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError


class TrackerError(ValueError):
    """Error for an invalid tracker, preset, parameter, image or box; the message has a remedy."""


def closest_match(name: str, valid_names: Iterable[str]) -> str:
    """Return the valid name that is most similar to `name`; empty if none is similar.

    >>> closest_match("kcf", ["camshift", "opencv-kcf"])
    'opencv-kcf'
    """
    names = sorted(valid_names)
    parts = [other for other in names if name.lower() in other.split("-")]
    close = parts if len(parts) == 1 else get_close_matches(name, names, n=1)
    return close[0] if close else ""


def unknown_name_error(kind: str, name: str, valid_names: Iterable[str]) -> TrackerError:
    """Return the error for an unknown name, with the closest match or else all valid names."""
    names = sorted(valid_names)
    close = closest_match(name, names)
    hint = f"Did you mean {close!r}?" if close else f"Known: {', '.join(names) or 'none'}."
    return TrackerError(f"unknown {kind} {name!r}. {hint}")


class Parameters(BaseModel):
    """Base class of the parameters of a tracker.

    Each field is a parameter. Its type and bounds are validated; text from the command line is
    converted. Its description states the meaning, with the unit in brackets (`[pixels]`, …).
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def checked(cls, owner: str, values: Mapping[str, Any]) -> Self:
        """Return validated parameters of the tracker `owner`, from values or their texts by name.

        Missing parameters get their default values. Raises TrackerError for an unknown name, or a
        value outside the declared type or bounds.
        """
        for name in values:
            if name not in cls.model_fields:
                raise unknown_name_error(f"parameter of {owner}", name, cls.model_fields)
        try:
            return cls.model_validate(dict(values))
        except ValidationError as error:
            first = error.errors()[0]
            name = str(first["loc"][0]) if first["loc"] else "values"
            message = f"{owner}: parameter {name}={first['input']}: {first['msg']}."
            raise TrackerError(message) from None


# The following functions declare parameters by default value and meaning; the unit is in brackets.


def choice(default: Any, meaning: str) -> Any:
    """Return the field of a parameter whose values are limited by its type only."""
    return Field(default, description=meaning)


def fraction(default: float, meaning: str) -> Any:
    """Return the field of a number in [0, 1]."""
    return Field(default, ge=0.0, le=1.0, description=meaning)


def nonnegative(default: float, meaning: str) -> Any:
    """Return the field of a number ≥ 0."""
    return Field(default, ge=0.0, description=meaning)


def positive(default: float, meaning: str) -> Any:
    """Return the field of a number > 0."""
    return Field(default, gt=0.0, description=meaning)


def integer(default: int, meaning: str, minimum: int = 1, maximum: int | None = None) -> Any:
    """Return the field of an integer in [least, most]."""
    return Field(default, ge=minimum, le=maximum, description=meaning)
