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
    containing = [other for other in names if name.lower() in other.split("-")]
    close = containing if len(containing) == 1 else get_close_matches(name, names, n=1)
    return close[0] if close else ""


def unknown_name_error(noun: str, name: str, valid_names: Iterable[str]) -> TrackerError:
    """Return the error for an unknown name, with the closest match or else all valid names."""
    names = sorted(valid_names)
    close = closest_match(name, names)
    hint = f"Did you mean {close!r}?" if close else f"Known: {', '.join(names) or 'none'}."
    return TrackerError(f"unknown {noun} {name!r}. {hint}")


OPTION = "option"
"""Origin of a parameter that is no part of the method, only for experiments."""
HARNESS = "harness"
"""Origin of a parameter that the benchmark needs, such as the treatment of a lost target."""


def printed(passage: str) -> str:
    """Return the origin of a value that the paper prints in a passage, such as `eq. 10`."""
    return f"printed: {passage}"


def chosen(reason: str) -> str:  # name: the origin as users see it
    """Return the origin of a value that the paper does not print, with the reason of the choice."""
    return f"chosen: {reason}"


class Parameters(BaseModel):
    """Base class of the parameters of a tracker.

    Each field is a parameter. Its type and bounds are validated; text from the command line is
    converted. Its description states the meaning, with the unit in brackets (`[pixels]`, …). The
    parameters of a tracker of a paper also have an origin.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def origins(cls) -> dict[str, str]:
        """Return the sources of the values in `as-written`, by parameter that declares one."""
        declared = {name: field.json_schema_extra for name, field in cls.model_fields.items()}
        return {
            name: str(extra["origin"])
            for name, extra in declared.items()
            if isinstance(extra, dict)
        }

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


# The following functions declare parameters by default value, meaning and origin; the unit is in
# brackets at the end of the meaning.


def bounded(default: Any, meaning: str, *, origin: str = "", **bounds: Any) -> Any:
    """Return the field of a parameter with bounds of pydantic's `Field`, such as `ge=0, lt=1`."""
    extra: Any = {"origin": origin} if origin else None
    return Field(default, description=meaning, json_schema_extra=extra, **bounds)


def choice(default: Any, meaning: str, *, origin: str = "") -> Any:
    """Return the field of a parameter whose values are limited by its type only."""
    return bounded(default, meaning, origin=origin)


def fraction(default: float, meaning: str, *, origin: str = "") -> Any:
    """Return the field of a number in [0, 1]."""
    return bounded(default, meaning, origin=origin, ge=0.0, le=1.0)


def nonnegative(default: float, meaning: str, *, origin: str = "") -> Any:
    """Return the field of a number ≥ 0."""
    return bounded(default, meaning, origin=origin, ge=0.0)


def positive(default: float, meaning: str, *, origin: str = "") -> Any:
    """Return the field of a number > 0."""
    return bounded(default, meaning, origin=origin, gt=0.0)


def integer(
    default: int,
    meaning: str,
    minimum: int = 1,
    maximum: int | None = None,
    *,
    origin: str = "",
) -> Any:
    """Return the field of an integer in [minimum, maximum]."""
    return bounded(default, meaning, origin=origin, ge=minimum, le=maximum)
