"""Claims of a paper: entries of `claims.toml`.

A claim has one source, one measure and one test. CONTRIBUTING.md shows how to add one.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from trackmark.bench.papers.cases import (
    Case,
    MeasureName,
    PaperSequence,
    PaperTracker,
    SequenceNames,
    TrackerNames,
)
from trackmark.bench.papers.toml_table import NonEmptyText, TomlTable

Test = Literal["order", "no-worse", "no-worse both ways", "share"]

DEFAULT_SCENES = {"share": 24, "order": 32, "no-worse": 36, "no-worse both ways": 36}
"""Number of scenes per sequence by kind of test."""

SideRule = Literal["hardest", "by sequence", "fewest particles"]
"""Meaning of several trackers on one side of a comparison."""


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
        Result of the paper in the unit of ours, and its place; only the place without a number.
    sequences : tuple of PaperSequence
        For the test `share`, a scene succeeds if it succeeds on every
        sequence. In other tests each scene of each sequence is a statistical unit.
    better, worse : tuple of PaperTracker
        Trackers that are compared.
    side_rule : str
        Meaning of several trackers on one side. `hardest`: the least favourable one for the claim
        is used, chosen for each sequence by the mean over its scenes. `by sequence`: the tracker
        and the sequence in the same place of their lists belong together. `fewest particles`: the
        value of a scene is the logarithm to base 2 of the smallest number of particles with which
        the measure succeeds, or of twice the largest number if it never does.
    trackers : tuple of PaperTracker
        Trackers of a claim without comparison.
    measure : Measure
        Measure of a run, such as `mean_error:first=36`; `scenes.NAME` for a measure of scenes
        without stored runs.
    test : str
        Kind of test.
    margin : float
        Largest irrelevant difference, in the unit of the measure.
    unit : str
        Unit printed with a difference, if the unit of the measure does not name what is counted.
    falsified_if : str
        Result that refutes the claim.
    reason : str
        Reason for measure, sequence or margin.
    scenes : int
        Number of scenes per sequence; 0 for the number of its kind of test.
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
    side_rule: SideRule = "hardest"
    trackers: TrackerNames = ()
    measure: MeasureName
    test: Test
    margin: Annotated[float, Field(gt=0)] | None = None
    unit: str = ""
    falsified_if: NonEmptyText
    reason: NonEmptyText
    scenes: Annotated[int, Field(ge=0)] = 0

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
        sides = {len(self.better), len(self.worse)}
        if self.side_rule == "by sequence" and sides != {len(self.sequences)}:
            raise ValueError("`by sequence` needs one tracker per sequence on each side")
        return self

    @property
    def all_trackers(self) -> tuple[PaperTracker, ...]:
        """Trackers that the claim is about, and those that they are compared with."""
        return self.trackers + self.better + self.worse

    @property
    def n_scenes(self) -> int:
        """Number of scenes of each sequence."""
        return self.scenes or DEFAULT_SCENES[self.test]

    def pairs(self, trackers: tuple[PaperTracker, ...]) -> list[tuple[PaperTracker, PaperSequence]]:
        """Return the trackers of a side with the sequences on which they run."""
        if self.side_rule == "by sequence":
            return list(zip(trackers, self.sequences, strict=True)) if trackers else []
        return [(tracker, sequence) for tracker in trackers for sequence in self.sequences]

    def sides(self, setting: str) -> tuple[list[Case], list[Case]]:
        """Return the cases of both sides in a setting; the second is empty without comparison."""
        first, second = (
            [
                Case(tracker.spec(setting), sequence, self.n_scenes)
                for tracker, sequence in self.pairs(side)
            ]
            for side in (self.trackers or self.better, self.worse)
        )
        return first, second
