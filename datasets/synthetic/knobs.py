"""Knobs of a synthetic sequence: declared once, frozen, checked, part of its name."""

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from trackmark.datasets.interface import SequenceError
from trackmark.datasets.spec_string import format_text

Seed = Annotated[int, Field(ge=0, lt=2**32)]  # type of the knob `scene`, which every scene has


def seed(of: str) -> Any:
    """Declare the knob `scene`; it is the seed `of` what the text names."""
    return Field(0, description=f"seed of {of}")


class Knobs(BaseModel):
    """Base of every scene's knobs.

    A field is a knob: its type and bounds are checked, text as typed on the command line is
    accepted, and its description says meaning and unit (`[pixels]`, `[frames]`, …).
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def checked(cls, sequence: str, values: Mapping[str, Any]) -> Self:
        """Knobs from values or their text.

        `sequence`: Name of the sequence without options, for messages. `values`: Values by name;
        the rest take their defaults. Raises `SequenceError` for an unknown name or a value outside
        the declared type or bounds.
        """
        for name in values:
            if name not in cls.model_fields:
                close = get_close_matches(name, cls.model_fields, n=1)
                hint = f" Did you mean {close[0]!r}?" if close else ""
                known = ", ".join(sorted(cls.model_fields))
                raise SequenceError(f"{sequence}: unknown knob {name!r}.{hint} Known: {known}.")
        try:
            return cls.model_validate(dict(values))
        except ValidationError as error:
            first = error.errors()[0]
            where = f"knob {first['loc'][0]}={first['input']}: " if first["loc"] else ""
            message = first["msg"].removeprefix("Value error, ")
            raise SequenceError(f"{sequence}: {where}{message}.") from None

    @classmethod
    def described(cls) -> list[dict[str, Any]]:
        """What can be set: dicts with `name`, `default` and `meaning` (unit in brackets)."""
        return [
            {"name": name, "default": field.default, "meaning": field.description or ""}
            for name, field in cls.model_fields.items()
        ]

    def canonical_name(self, sequence: str) -> str:
        """Text form with the knobs that are not at their default, sorted by name."""
        defaults = type(self)()
        names = sorted(type(self).model_fields)
        chosen = {key: getattr(self, key) for key in names}
        return format_text(
            sequence, {key: v for key, v in chosen.items() if v != getattr(defaults, key)}
        )


class SceneKnobs(Knobs):
    """Knobs of a scene of which only the seed can be set."""

    scene: Seed = 0


def seeded(of: str) -> type[SceneKnobs]:
    """Return the knobs of a scene whose seed draws what the text names."""
    return create_model("SeededKnobs", __base__=SceneKnobs, scene=(Seed, seed(of)))
