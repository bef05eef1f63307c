"""Parameters of trackers: declaration, validation and error messages."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Literal, Self

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


@dataclass(frozen=True)
class Origin:
    """Source of the value that a parameter has in the preset `as-written`.

    Attributes
    ----------
    kind : str
        `printed`: the paper prints the value. `chosen`: the method needs a value that the paper
        does not print. `option`: no part of the method, only for experiments. `harness`: set by
        the benchmark, such as the treatment of a lost target.
    text : str
        Place in the paper, or the reason of a choice; empty for an option and the harness.
    """

    kind: Literal["printed", "chosen", "option", "harness"]
    text: str = ""

    def __str__(self) -> str:
        return f"{self.kind}: {self.text}" if self.text else self.kind


OPTION, HARNESS = Origin("option"), Origin("harness")


def printed(place: str) -> Origin:
    """Return the origin of a value that the paper prints at a place, such as `eq. 10`."""
    return Origin("printed", place)


def chosen(reason: str) -> Origin:
    """Return the origin of a value that the paper does not print, with the reason of the choice."""
    return Origin("chosen", reason)


class Parameters(BaseModel):
    """Base class of the parameters of a tracker.

    Each field is a parameter. Its type and bounds are validated; text from the command line is
    converted. Its description states the meaning, with the unit in brackets (`[pixels]`, …). The
    parameters of a tracker of a paper also have an origin.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def origins(cls) -> dict[str, Origin]:
        """Return the origins by parameter, without parameters that declare none."""
        origins: dict[str, Origin] = {}
        for name, field in cls.model_fields.items():
            extra = field.json_schema_extra
            origin = extra.get("origin") if isinstance(extra, dict) else None
            if isinstance(origin, Origin):
                origins[name] = origin
        return origins

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


def bounded(default: Any, meaning: str, *, origin: Origin | None = None, **bounds: Any) -> Any:
    """Return the field of a parameter with bounds of pydantic's `Field`, such as `ge=0, lt=1`."""
    extra: Any = {"origin": origin} if origin else None
    return Field(default, description=meaning, json_schema_extra=extra, **bounds)


def choice(default: Any, meaning: str, *, origin: Origin | None = None) -> Any:
    """Return the field of a parameter whose values are limited by its type only."""
    return bounded(default, meaning, origin=origin)


def fraction(default: float, meaning: str, *, origin: Origin | None = None) -> Any:
    """Return the field of a number in [0, 1]."""
    return bounded(default, meaning, origin=origin, ge=0.0, le=1.0)


def nonnegative(default: float, meaning: str, *, origin: Origin | None = None) -> Any:
    """Return the field of a number ≥ 0."""
    return bounded(default, meaning, origin=origin, ge=0.0)


def positive(default: float, meaning: str, *, origin: Origin | None = None) -> Any:
    """Return the field of a number > 0."""
    return bounded(default, meaning, origin=origin, gt=0.0)


def integer(
    default: int,
    meaning: str,
    minimum: int = 1,
    maximum: int | None = None,
    *,
    origin: Origin | None = None,
) -> Any:
    """Return the field of an integer in [minimum, maximum]."""
    return bounded(default, meaning, origin=origin, ge=minimum, le=maximum)
