"""Tables of a paper's TOML files, and the check of their fields."""

from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from trackmark.bench.experiments.experiment import ExperimentError


def as_tuple(value: Any) -> Any:
    """Convert a text to a tuple that contains it; return other values unchanged."""
    return (value,) if isinstance(value, str) else value


NonEmptyText = Annotated[str, Field(min_length=1)]
Texts = Annotated[tuple[str, ...], BeforeValidator(as_tuple)]
"""List of texts, or one text."""


class TomlTable(BaseModel):
    """Table of a TOML file; unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


Table = TypeVar("Table", bound=TomlTable)


def validated(model: type[Table], table: dict[str, Any], location: str, names: Any = None) -> Table:
    """Validate a table; raise `ExperimentError` with the location and the first wrong field.

    `names`: objects that the names in the table stand for; see `cases.Names`.
    """
    try:
        return model.model_validate(table, context=names)
    except ValidationError as error:
        first: Any = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"])
        message = first["msg"].removeprefix("Value error, ").rstrip(".")
        raise ExperimentError(f"{location}{f', {field}' if field else ''}: {message}.") from None
