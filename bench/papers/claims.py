"""Claims of a paper: entries of `claims.toml`.

A claim has one source, one measure and one test. CONTRIBUTING.md shows how to add one.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from trackmark.bench.papers.cases import (
    Case,
    MeasureName,
    PaperTracker,
    SequenceNames,
    TrackerNames,
    cases,
)
from trackmark.bench.papers.toml_table import NonEmptyText, TomlTable

Test = Literal["order", "no-worse", "no-worse both ways", "share", "time", "number"]

DEFAULT_SCENES = {"share": 24, "order": 32, "no-worse": 36, "no-worse both ways": 36}
"""Number of scenes per sequence by kind of test; 24 for other kinds."""


class Claim(TomlTable):
    """Claim of a paper.

    Attributes
    ----------
    name : str
        Identifier, such as `WA-7`.
    source, quote : str
        Table, figure or section of the paper, and its words.
    summary, statement : str
        Claim in a few words, and in a sentence.
    paper : str
        Result of the paper, printed next to ours.
    sequences : tuple of PaperSequence
        For the test `share`, a scene succeeds if it succeeds on every
        sequence. In other tests each scene of each sequence is a statistical unit.
    better, worse : tuple of PaperTracker
        Trackers that are compared. Of several trackers the least favourable one for
        the claim is used, chosen for each sequence by the mean over its scenes.
    trackers : tuple of PaperTracker
        Trackers of a claim without comparison.
    measure : Measure
        Measure of a run, such as `mean_error:first=36`; `scenes.NAME` for a measure of scenes
        without stored runs; `timing.NAME` for times.
    test : str
        Kind of test.
    margin : float
        Largest irrelevant difference, in the unit of the measure.
    limit : float or None
        Ratio that a time must exceed; with a `unit` of time, the time that it must stay below.
    falsified_if : str
        Result that refutes the claim.
    reason : str
        Reason for measure, sequence or margin.
    scenes : int
        Number of scenes per sequence; 0 for the number of its kind of test.
    note : str
        Printed next to the verdict.
    """

    name: NonEmptyText
    source: NonEmptyText
    quote: NonEmptyText
    summary: Annotated[str, Field(min_length=1, max_length=60)]
    statement: NonEmptyText
    paper: NonEmptyText
    sequences: SequenceNames = ()
    better: TrackerNames = ()
    worse: TrackerNames = ()
    trackers: TrackerNames = ()
    measure: MeasureName
    test: Test
    margin: Annotated[float, Field(gt=0)] | None = None
    limit: Annotated[float, Field(gt=0)] | None = None
    falsified_if: str = ""
    reason: NonEmptyText
    scenes: Annotated[int, Field(ge=0)] = 0
    note: str = ""

    @model_validator(mode="after")
    def _check_sides(self) -> "Claim":
        compares = self.test.startswith(("order", "no-worse"))
        if bool(self.better) != bool(self.worse) or (self.better and self.trackers):
            raise ValueError("give `better` and `worse` together, or `trackers`")
        if self.better and not compares:
            raise ValueError(
                f"a test of kind {self.test!r} takes `trackers`, not `better` and `worse`"
            )
        if compares and self.margin is None:
            raise ValueError(f"a test of kind {self.test!r} needs a `margin`")
        if self.test != "number" and not self.falsified_if:
            raise ValueError("`falsified_if` is empty; expected: the result that refutes the claim")
        return self

    @property
    def all_trackers(self) -> tuple[PaperTracker, ...]:
        """Trackers that the claim is about, and those that they are compared with."""
        return self.trackers + self.better + self.worse

    @property
    def n_scenes(self) -> int:
        """Number of scenes of each sequence."""
        return self.scenes or DEFAULT_SCENES.get(self.test, 24)

    def cases(self, setting: str) -> list[Case]:
        """Return the cases of all trackers of the claim in a setting."""
        return cases(self.all_trackers, self.sequences, setting, self.n_scenes)
