"""Criteria that the scenes of a paper must meet, and their stored values.

`criteria.toml` states the criteria. `criteria.csv` has their values on each scene, which
`tools/scene_check.py` measured on images and ground truth. Claims are judged
on the first scenes that meet all criteria.
"""

import operator
from typing import Literal

import pandas as pd
from pydantic import model_validator

from trackmark.bench.experiments.experiment import ExperimentError, read_toml
from trackmark.bench.papers import paper_file
from trackmark.bench.papers.toml_table import NonEmptyText, TomlTable, as_tuple, validated

FIRST_SCENE = 200
"""Default first scene of a sequence. Scenes with lower numbers were used to design the scenes."""

COMPARISONS = {"<=": operator.le, ">=": operator.ge}

Kind = Literal["situation", "difficulty", "outcome"]


class Criterion(TomlTable):
    """Entry of a paper's `criteria.toml`.

    The kind says what a bound depends on. A *situation* is what the paper's video shows. A
    *difficulty* is the problem that the claim poses, measured on images and ground truth. A
    criterion is an *outcome* if its bound or sentence uses a result about a tracker, comes from a
    tracker's parameters, or measures a feature or score of a compared tracker. Scenes that were
    selected by an outcome favour the claims in `favours`, so these claims cannot be counted as
    evidence if they hold.

    `measure` names a function of `tools.criteria` with its options, such as `slow_share:limit=1`.
    `target` contains the bounds that every scene must meet, such as `<= 0.1` or `>= 4, <= 9`; it is
    empty for a number that is only printed.
    """

    sequence: NonEmptyText  # specification without the scene; options name a variant
    name: NonEmptyText  # measured quantity with its unit
    kind: Kind  # name: key of criteria.toml
    measure: NonEmptyText
    # the paper's words, or recorded data, from which the bound is derived
    sentence: NonEmptyText
    target: str = ""
    favours: tuple[NonEmptyText, ...] | None = None  # claims; only and always of an outcome

    @model_validator(mode="after")
    def _check_favours(self) -> "Criterion":
        if (self.kind == "outcome") != (self.favours is not None):
            problem = "needs" if self.favours is None else "has"
            raise ValueError(
                f"{self.kind} {self.name!r} {problem} `favours`; expected: in every outcome, and "
                "in no other kind"
            )
        return self

    @property
    def favoured(self) -> frozenset[str]:
        """Claims that the bounds favour. A printed number excludes no scene and favours none."""
        return frozenset(self.favours or ()) if self.target else frozenset()

    def passes(self, value: float) -> bool:
        """Return whether a value meets all bounds of the target."""
        bounds = [bound.split() for bound in self.target.split(",") if bound.strip()]
        return all(COMPARISONS[sign](value, float(limit)) for sign, limit in bounds)


def read_criteria(paper: str) -> tuple[dict[str, int], list[Criterion]]:
    """Read `criteria.toml`; return first scenes by sequence, and the criteria.

    An entry that names several sequences gives one criterion per sequence.

    Raises
    ------
    ExperimentError
        If a field is missing, unknown or wrong; the message names file, entry and field.
    """
    path = paper_file(paper, "criteria.toml")
    table = read_toml(path, ExperimentError)
    criteria = list[Criterion]()
    for position, fields in enumerate(table["criterion"], start=1):
        location = f"{path}: criterion {position}"
        criteria += [
            validated(Criterion, {**fields, "sequence": sequence}, location)
            for sequence in as_tuple(fields["sequence"])
        ]
    order = list(dict.fromkeys(criterion.sequence for criterion in criteria))
    first = dict.fromkeys(order, FIRST_SCENE) | table.get("first_scene", {})
    return first, sorted(criteria, key=lambda criterion: order.index(criterion.sequence))


def favoured(paper: str) -> frozenset[str]:
    """Return the claims that the selection of a paper's scenes favours, from `criteria.toml`."""
    return frozenset().union(*(criterion.favoured for criterion in read_criteria(paper)[1]))


def read_values(paper: str) -> pd.DataFrame:
    """Read the stored values of a paper's criteria.

    Columns: `sequence`, `scene`, `name` (of the criterion), `value`, and `passes`, which is True if
    the value meets the criterion.
    """
    file = paper_file(paper, "criteria.csv")
    return pd.read_csv(file, true_values=["yes"], false_values=["no"], encoding="utf-8")


def passing_scenes(values: pd.DataFrame, sequence: str) -> list[int]:
    """Return the scenes of a sequence that meet all criteria, in order."""
    passes = values[values["sequence"] == sequence].groupby("scene", sort=False)["passes"].all()
    scenes: list[int] = passes.index[passes].tolist()
    return scenes
