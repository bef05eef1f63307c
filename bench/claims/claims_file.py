"""Claims of a paper, as its `claims.toml` states them.

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
"""Scenes of each sequence, by kind of test; 24 for the others."""


def as_tuple(value: Any) -> Any:
    """Return a single text as a tuple of one."""
    return (value,) if isinstance(value, str) else value


Text = Annotated[str, Field(min_length=1)]
Names = Annotated[tuple[Text, ...], BeforeValidator(as_tuple)]
"""A list of names, or one name."""


class Entry(BaseModel):
    """A table of a TOML file: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


E = TypeVar("E", bound=Entry)


class Claim(Entry):
    """A claim of a paper.

    Attributes
    ----------
    name : str
        Identifier, as `WA-7`.
    source, quote : str
        Table, figure or section of the paper, and its words.
    short, says : str
        The claim in a few words, and in a sentence.
    paper : str
        The paper's number or description, printed next to ours.
    sequences : tuple of str
        Names of `paper.toml`. A share holds in a scene if it does so on every sequence; other
        tests count each scene of each sequence.
    better, worse : tuple of str
        Trackers of `paper.toml` that are compared. Of several on a side, the one that makes the
        claim hardest to hold is compared, chosen for each sequence by the mean over its scenes.
    of : tuple of str
        Trackers that are not compared.
    measure : str
        Measure of a run in text form, as `mean_error:first=36`; `scenes.NAME` for a measure of
        scenes without a run, and `timing.NAME` for times.
    test : str
        Kind of test.
    margin : float
        Differences up to this are irrelevant in practice, in the unit of the measure.
    limit : float or None
        Ratio that a time must exceed; with a `unit` of time, the time that it must stay below.
    falsified : str
        What would show that the claim does not hold.
    reason : str
        Why this measure, sequence or margin.
    scenes : int
        Scenes of each sequence; 0 for as many as its kind of test takes.
    note : str
        Printed next to the verdict.
    """

    name: Text
    source: Text
    quote: Text
    short: Annotated[str, Field(min_length=1, max_length=60)]
    says: Text
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
            raise ValueError("`falsified` must say what would show that the claim does not hold")
        return self

    @property
    def trackers(self) -> tuple[str, ...]:
        """All trackers that it names."""
        return self.of + self.better + self.worse

    @property
    def n_scenes(self) -> int:
        """Scenes of each sequence."""
        return self.scenes or DEFAULT_SCENES.get(self.test, 24)


def read_claims(paper: str, path: Path | None = None) -> dict[str, Claim]:
    """Read the claims of a paper by their identifiers; `path` replaces its own file.

    Raises
    ------
    ExperimentError
        Naming the file, the claim and the field that is missing, unknown or wrong.
    """
    path = path or FOLDER / paper / "claims.toml"
    table = read_toml(path, ExperimentError)
    return {
        name: checked(Claim, {"name": name, **entry}, f"{path}: claim {name}")
        for name, entry in table.items()
    }


def checked(kind: type[E], table: dict[str, Any], place: str) -> E:
    """Return an entry; raise `ExperimentError` that names the place and the first wrong field."""
    try:
        return kind.model_validate(table)
    except ValidationError as error:
        first: Any = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"])
        words = first["msg"].removeprefix("Value error, ")
        raise ExperimentError(f"{place}{f', {field}' if field else ''}: {words}.") from None
