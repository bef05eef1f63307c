"""Check of scenes by the criteria of a paper.

`python -m trackmark.bench.papers.scene_check PAPER` measures every criterion of `criteria.toml` on
the first scenes of each sequence, without a tracker. With `--write` it stores the values in
`criteria.csv`. Claims are judged on the first scenes that meet all criteria.
"""

import argparse
import csv
import inspect
import operator
import sys
import tomllib
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from trackmark import datasets
from trackmark.bench.papers.criteria import shared
from trackmark.bench.papers.criteria.nguyen2002 import ClipSet
from trackmark.bench.papers.criteria.shared import SceneImages
from trackmark.bench.papers.measures import paper_module, typed_option
from trackmark.datasets.spec_string import parse_text

FOLDER = Path(__file__).parent
CHECKED_SCENES = 40
FIRST_SCENE = 200  # default first scene; scenes with lower numbers were used to design the scenes
CLIPS = "nguyen2002/clips"  # sequence whose scene is a set of clips
COMPARISONS = {"<=": operator.le, ">=": operator.ge}


@dataclass(frozen=True)
class Criterion:
    """Entry of a paper's `criteria.toml`.

    `measure` names a function of `bench.papers.criteria` (in the paper's module or in `shared`)
    with its options, such as `slow_share:limit=1`. `target` contains the bounds that every scene
    must meet, such as `<= 0.1` or `>= 4, <= 9`; it is empty for a number that is only printed.
    """

    sequence: str  # specification without the scene
    name: str  # measured quantity with its unit
    measure: str
    sentence: str  # sentence of the paper that requires the criterion, with its section
    target: str = ""
    with_result_in_view: bool = False  # True: the criterion uses a result of the paper

    def value(self, scene: SceneImages | ClipSet) -> float:
        """Measure the criterion on a scene."""
        name, options = parse_text(self.measure)
        paper_criteria = paper_module("criteria", self.sequence.partition("/")[0])
        function = getattr(paper_criteria, name, None) or getattr(shared, name)
        parameters = inspect.signature(function).parameters
        typed = {
            key: typed_option(text, parameters[key].annotation) for key, text in options.items()
        }
        return float(function(scene, **typed))

    def passes(self, value: float) -> bool:
        """Return whether a value meets all bounds of the target."""
        bounds = [bound.split() for bound in self.target.split(",") if bound.strip()]
        return all(COMPARISONS[sign](value, float(limit)) for sign, limit in bounds)


@dataclass(frozen=True)
class CriterionValue:
    """Value of a criterion on one scene: a row of `criteria.csv`."""

    sequence: str
    scene: int
    name: str
    value: float
    passes: bool


def read_criteria(paper: str) -> tuple[dict[str, int], list[Criterion]]:
    """Read `criteria.toml`; return first scenes by sequence, and the criteria.

    An entry that names several sequences gives one criterion per sequence.
    """
    with (FOLDER / paper / "criteria.toml").open("rb") as file:
        table = tomllib.load(file)
    rows = []
    for row in table["criterion"]:
        sequences = row.pop("sequence")
        named = [sequences] if isinstance(sequences, str) else sequences
        rows += [Criterion(sequence, **row) for sequence in named]
    order = list(dict.fromkeys(row.sequence for row in rows))
    first = dict.fromkeys(order, FIRST_SCENE) | table.get("first_scene", {})
    return first, sorted(rows, key=lambda row: order.index(row.sequence))


def check_scene(sequence: str, scene: int, rows: list[Criterion]) -> list[CriterionValue]:
    """Measure all criteria of a sequence on one scene."""
    images: SceneImages | ClipSet = (
        ClipSet.load(scene)
        if sequence == CLIPS
        else SceneImages(datasets.load(f"{sequence}:scene={scene}"))
    )
    values = [row.value(images) for row in rows]
    return [
        CriterionValue(sequence, scene, row.name, value, row.passes(value))
        for row, value in zip(rows, values, strict=True)
    ]


def check_paper(
    paper: str, count: int, jobs: int, *, only: str = "", first_scene: int | None = None
) -> list[CriterionValue]:
    """Measure a paper's criteria on the first `count` scenes of each sequence.

    `only`: part of the names of the checked sequences. `first_scene`: replaces the first scene of
    `criteria.toml`.
    """
    frozen, rows = read_criteria(paper)
    sequences = [name for name in dict.fromkeys(row.sequence for row in rows) if only in name]
    starts = {name: frozen[name] if first_scene is None else first_scene for name in sequences}
    with ProcessPoolExecutor(jobs) as pool:
        pending = [
            pool.submit(check_scene, sequence, scene, [r for r in rows if r.sequence == sequence])
            for sequence, start in starts.items()
            for scene in range(start, start + count)
        ]
        return [row for future in pending for row in future.result()]


def read_values(paper: str) -> list[CriterionValue]:
    """Read the stored values of a paper's criteria."""
    with (FOLDER / paper / "criteria.csv").open(newline="") as file:
        return [
            CriterionValue(
                r["sequence"], int(r["scene"]), r["name"], float(r["value"]), r["passes"] == "yes"
            )
            for r in csv.DictReader(file)
        ]


def write_values(paper: str, rows: list[CriterionValue]) -> None:
    """Write the values of a paper's criteria to `criteria.csv`."""
    with (FOLDER / paper / "criteria.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["sequence", "scene", "name", "value", "passes"])
        for row in rows:
            passes = "yes" if row.passes else "no"
            writer.writerow([row.sequence, row.scene, row.name, f"{row.value:.4g}", passes])


def passing_scenes(rows: list[CriterionValue], sequence: str) -> Iterator[int]:
    """Yield the scenes of a sequence that meet all criteria, in order."""
    scenes: dict[int, bool] = {}
    for row in rows:
        if row.sequence == sequence:
            scenes[row.scene] = scenes.get(row.scene, True) and row.passes
    yield from (scene for scene, passes in scenes.items() if passes)


def summary(declared: list[Criterion], rows: list[CriterionValue]) -> str:
    """Return median, range and number of passing scenes of each criterion as text."""
    lines = []
    for criterion in declared:
        criterion_rows = [
            r for r in rows if (r.sequence, r.name) == (criterion.sequence, criterion.name)
        ]
        if criterion_rows:
            values = sorted(row.value for row in criterion_rows)
            passed = sum(row.passes for row in criterion_rows)
            lines.append(
                f"{criterion.sequence:38} {criterion.name:50} median {median(values):.3g} "
                f"[{values[0]:.3g}, {values[-1]:.3g}] target {criterion.target or '-'}: "
                f"{passed} of {len(criterion_rows)}"
            )
    for sequence in dict.fromkeys(row.sequence for row in rows):
        passing = list(passing_scenes(rows, sequence))
        checked = len({row.scene for row in rows if row.sequence == sequence})
        lines.append(f"{sequence}: {len(passing)} of {checked} scenes meet all criteria")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure a paper's criteria, print their summary and, with `--write`, store `criteria.csv`."""
    parser = argparse.ArgumentParser(prog="python -m trackmark.bench.papers.scene_check")
    parser.add_argument("paper")
    parser.add_argument("--scenes", type=int, default=CHECKED_SCENES, help="scenes per sequence")
    parser.add_argument("--first", type=int, help="number of the first scene")
    parser.add_argument(
        "--only", default="", help="check only sequences with this text in the name"
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--write", action="store_true", help="write criteria.csv")
    arguments = parser.parse_args()
    rows = check_paper(
        arguments.paper,
        arguments.scenes,
        arguments.jobs,
        only=arguments.only,
        first_scene=arguments.first,
    )
    sys.stdout.write(summary(read_criteria(arguments.paper)[1], rows))
    if arguments.write:
        measured = {row.sequence for row in rows}
        stored_rows = [] if not arguments.only else read_values(arguments.paper)
        rows += [row for row in stored_rows if row.sequence not in measured]
        order = [criterion.sequence for criterion in read_criteria(arguments.paper)[1]]
        write_values(arguments.paper, sorted(rows, key=lambda row: order.index(row.sequence)))


if __name__ == "__main__":
    main()
