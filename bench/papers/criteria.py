"""Criteria that the scenes of a paper must meet, and their stored values.

`criteria.toml` states the criteria. `criteria.csv` has their values on each scene, which
`tools/scene_check.py` measured on images and ground truth. Claims are judged
on the first scenes that meet all criteria.
"""

import operator
import tomllib
from dataclasses import dataclass

import pandas as pd

from trackmark.bench.papers import paper_file

FIRST_SCENE = 200
"""Default first scene of a sequence. Scenes with lower numbers were used to design the scenes."""

COMPARISONS = {"<=": operator.le, ">=": operator.ge}


@dataclass(frozen=True)
class Criterion:
    """Entry of a paper's `criteria.toml`.

    `measure` names a function of `tools.criteria` with its options, such as `slow_share:limit=1`.
    `target` contains the bounds that every scene must meet, such as `<= 0.1` or `>= 4, <= 9`; it is
    empty for a number that is only printed.
    """

    sequence: str  # specification without the scene
    name: str  # measured quantity with its unit
    measure: str
    sentence: str  # sentence of the paper that requires the criterion, with its section
    target: str = ""
    with_result_in_view: bool = False  # True: the criterion uses a result of the paper

    def passes(self, value: float) -> bool:
        """Return whether a value meets all bounds of the target."""
        bounds = [bound.split() for bound in self.target.split(",") if bound.strip()]
        return all(COMPARISONS[sign](value, float(limit)) for sign, limit in bounds)


def read_criteria(paper: str) -> tuple[dict[str, int], list[Criterion]]:
    """Read `criteria.toml`; return first scenes by sequence, and the criteria.

    An entry that names several sequences gives one criterion per sequence.
    """
    table = tomllib.loads(paper_file(paper, "criteria.toml").read_text("utf-8"))
    criteria = []
    for criterion_table in table["criterion"]:
        sequences = criterion_table.pop("sequence")
        names = [sequences] if isinstance(sequences, str) else sequences
        criteria += [Criterion(sequence, **criterion_table) for sequence in names]
    order = list(dict.fromkeys(criterion.sequence for criterion in criteria))
    first = dict.fromkeys(order, FIRST_SCENE) | table.get("first_scene", {})
    return first, sorted(criteria, key=lambda criterion: order.index(criterion.sequence))


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
