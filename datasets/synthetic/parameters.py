"""Parameters of synthetic sequences: declaration, validation, canonical names."""

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from trackmark.datasets.interface import SequenceError
from trackmark.datasets.spec_string import format_text, name_hint

# type of the parameter `scene`, which every sequence has
Seed = Annotated[int, Field(ge=0, lt=2**32)]


def seed(subject: str) -> Any:
    """Declare the parameter `scene`; `subject` describes what the seed determines."""
    return Field(0, description=f"seed of {subject}")


class SequenceParameters(BaseModel):
    """Base class of the parameters of a synthetic sequence.

    Each field is a parameter. Values may be text of the command line; type and range are checked.
    The description of a field is the parameter's meaning with its unit (`[pixels]`, `[frames]`, …).
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def checked(cls, sequence: str, values: Mapping[str, Any]) -> Self:
        """Return validated parameters.

        `sequence` is the name of the sequence without options, for messages. `values` are values or
        their text, by name; other parameters have their defaults. Raises `SequenceError` for an
        unknown name or an invalid value.
        """
        for name in values:
            if name not in cls.model_fields:
                hint = name_hint(name, sorted(cls.model_fields))
                raise SequenceError(f"{sequence}: unknown parameter {name!r}.{hint}")
        try:
            return cls.model_validate(dict(values))
        except ValidationError as error:
            first = error.errors()[0]
            prefix = f"parameter {first['loc'][0]}={first['input']}: " if first["loc"] else ""
            message = first["msg"].removeprefix("Value error, ")
            raise SequenceError(f"{sequence}: {prefix}{message}.") from None

    @classmethod
    def described(cls) -> list[dict[str, Any]]:
        """Return `name`, `default` and `meaning` (unit in brackets) of every parameter."""
        return [
            {"name": name, "default": field.default, "meaning": field.description or ""}
            for name, field in cls.model_fields.items()
        ]

    def canonical_name(self, sequence: str) -> str:
        """Return the specification: the name and the non-default parameters, sorted by name."""
        defaults = type(self)()
        names = sorted(type(self).model_fields)
        chosen = {key: getattr(self, key) for key in names}
        return format_text(
            sequence, {key: v for key, v in chosen.items() if v != getattr(defaults, key)}
        )


class SceneParameters(SequenceParameters):
    """Parameters of a scene that has only a seed."""

    scene: Seed = 0


def seeded(subject: str) -> type[SceneParameters]:
    """Return the parameters of a scene that has only a seed; `subject` is as in `seed`."""
    return create_model("SeededParameters", __base__=SceneParameters, scene=(Seed, seed(subject)))
