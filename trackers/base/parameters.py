"""Parameters of a tracker: declared once, frozen, checked, said in words."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError


class TrackerError(ValueError):
    """A tracker, preset or parameter that cannot be; the message says which and what to do."""


def closest(name: str, known: Iterable[str]) -> str:
    """The known name that was most likely meant; empty where none is like it.

    >>> closest("kcf", ["camshift", "opencv-kcf"])
    'opencv-kcf'
    """
    names = sorted(known)
    parts = [other for other in names if name.lower() in other.split("-")]
    close = parts if len(parts) == 1 else get_close_matches(name, names, n=1)
    return close[0] if close else ""


def unknown(kind: str, name: str, known: Iterable[str]) -> TrackerError:
    """Error for a name that is not known: the closest match, then all that are known."""
    names = sorted(known)
    close = closest(name, names)
    hint = f" Did you mean {close!r}?" if close else ""
    return TrackerError(f"unknown {kind} {name!r}.{hint} Known: {', '.join(names) or 'none'}.")


class Parameters(BaseModel):
    """Base of every tracker's parameters.

    A field is a parameter: its type and bounds are checked, text as typed on the command
    line is accepted, and its description says meaning and unit (`[pixels]`, `[frames]`, …).
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def checked(cls, owner: str, values: Mapping[str, Any]) -> Self:
        """Parameters of the tracker `owner` from values or their text; the rest take defaults.

        Raises
        ------
        TrackerError
            For an unknown name or a value outside the declared type or bounds.
        """
        for name in values:
            if name not in cls.model_fields:
                raise unknown(f"parameter of {owner}", name, cls.model_fields)
        try:
            return cls.model_validate(dict(values))
        except ValidationError as error:
            first = error.errors()[0]
            name = str(first["loc"][0]) if first["loc"] else "values"
            message = f"{owner}: parameter {name}={first['input']}: {first['msg']}."
            raise TrackerError(message) from None


# Fields as most parameters are declared: default, and meaning with its unit in brackets.


def choice(default: Any, meaning: str) -> Any:
    """Field of a parameter whose type says all that it may be."""
    return Field(default, description=meaning)


def fraction(default: float, meaning: str) -> Any:
    """Field of a number in [0, 1]."""
    return Field(default, ge=0.0, le=1.0, description=meaning)


def nonnegative(default: float, meaning: str) -> Any:
    """Field of a number of 0 or more."""
    return Field(default, ge=0.0, description=meaning)


def positive(default: float, meaning: str) -> Any:
    """Field of a number above 0."""
    return Field(default, gt=0.0, description=meaning)


def whole(default: int, meaning: str, least: int = 1, most: int | None = None) -> Any:
    """Field of a whole number between two, which are included."""
    return Field(default, ge=least, le=most, description=meaning)
