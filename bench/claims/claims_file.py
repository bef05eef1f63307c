"""Reader of `claims.toml`.

read_claims("wang2010") -> {"WA-7": Claim(...), ...}

A claim has one source, one measure and one test. CONTRIBUTING.md shows how to add one.
"""

from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from trackmark.bench.experiments.experiment import ExperimentError, read_toml

FOLDER = Path(__file__).parent.parent / "papers"

Test = Literal["order", "no-worse", "no-worse both ways", "share", "time", "number"]

DEFAULT_SCENES = {"share": 24, "order": 32, "no-worse": 36, "no-worse both ways": 36}
"""Number of scenes per sequence by kind of test; 24 for other kinds."""


def as_tuple(value: Any) -> Any:
    """Convert a text to a tuple that contains it; return other values unchanged."""
    return (value,) if isinstance(value, str) else value


Text = Annotated[str, Field(min_length=1)]
Names = Annotated[tuple[Text, ...], BeforeValidator(as_tuple)]
"""List of names, or one name."""


class Entry(BaseModel):
    """Table of a TOML file; unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


E = TypeVar("E", bound=Entry)


class Claim(Entry):
    """Claim of a paper.

    Attributes
    ----------
    name : str
        Identifier, such as `WA-7`.
    source, quote : str
        Table, figure or section of the paper, and its words.
    short, statement : str
        Claim in a few words, and in a sentence.
    paper : str
        Result of the paper, printed next to ours.
    sequences : tuple of str
        Names of `paper.toml`. For the test `share`, a scene succeeds if it succeeds on every
        sequence. In other tests each scene of each sequence is a statistical unit.
    better, worse : tuple of str
        Trackers of `paper.toml` that are compared. Of several trackers the least favourable one for
        the claim is used, chosen for each sequence by the mean over its scenes.
    of : tuple of str
        Trackers of a claim without comparison.
    measure : str
        Measure of a run, such as `mean_error:first=36`; `scenes.NAME` for a measure of scenes
        without runs; `timing.NAME` for times.
    test : str
        Kind of test.
    margin : float
        Largest irrelevant difference, in the unit of the measure.
    limit : float or None
        Ratio that a time must exceed; with a `unit` of time, the time that it must stay below.
    falsified : str
        Result that refutes the claim.
    reason : str
        Reason for measure, sequence or margin.
    scenes : int
        Number of scenes per sequence; 0 for the number of its kind of test.
    note : str
        Printed next to the verdict.
    """

    name: Text
    source: Text
    quote: Text
    short: Annotated[str, Field(min_length=1, max_length=60)]
    statement: Text
    paper: Text
    sequences: Names = ()
    better: Names = ()
    worse: Names = ()
    of: Names = ()
    measure: Text
    test: Test
    margin: Annotated[float, Field(gt=0)] | None = None
    limit: Annotated[float, Field(gt=0)] | None = None
    falsified: str = ""
    reason: Text
    scenes: Annotated[int, Field(ge=0)] = 0
    note: str = ""

    @model_validator(mode="after")
    def _check_sides(self) -> "Claim":
        compares = self.test.startswith(("order", "no-worse"))
        if bool(self.better) != bool(self.worse) or (self.better and self.of):
            raise ValueError("give `better` and `worse` together, or `of`")
        if self.better and not compares:
            raise ValueError(f"a test of kind {self.test!r} takes `of`, not `better` and `worse`")
        if compares and self.margin is None:
            raise ValueError(f"a test of kind {self.test!r} needs a `margin`")
        if self.test != "number" and not self.falsified:
            raise ValueError("`falsified` is empty; expected: the result that refutes the claim")
        return self

    @property
    def trackers(self) -> tuple[str, ...]:
        """All trackers of the claim."""
        return self.of + self.better + self.worse

    @property
    def n_scenes(self) -> int:
        """Number of scenes of each sequence."""
        return self.scenes or DEFAULT_SCENES.get(self.test, 24)


def read_claims(paper: str, path: Path | None = None) -> dict[str, Claim]:
    """Read the claims of a paper by identifier, or those of the file `path` instead.

    Raises
    ------
    ExperimentError
        If a field is missing, unknown or wrong; the message names file, claim and field.
    """
    path = path or FOLDER / paper / "claims.toml"
    table = read_toml(path, ExperimentError)
    return {
        name: checked(Claim, {"name": name, **entry}, f"{path}: claim {name}")
        for name, entry in table.items()
    }


def checked(kind: type[E], table: dict[str, Any], place: str) -> E:
    """Validate an entry; raise `ExperimentError` with the place and the first wrong field."""
    try:
        return kind.model_validate(table)
    except ValidationError as error:
        first: Any = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"])
        words = first["msg"].removeprefix("Value error, ")
        raise ExperimentError(f"{place}{f', {field}' if field else ''}: {words}.") from None
