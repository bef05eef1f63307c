"""Measurement of a paper's criteria on its scenes, without a tracker.

`python -m tools.scene_check PAPER` measures every criterion of `criteria.toml` on the first scenes
of each sequence. With `--write` it stores the values in `criteria.csv`.
"""

import argparse
import importlib
import sys
from concurrent.futures import ProcessPoolExecutor

import pandas as pd

from tools.criteria import shared
from tools.criteria.nguyen2002 import ClipSet
from tools.criteria.shared import SceneImages
from trackmark import datasets
from trackmark.bench.papers import paper_file
from trackmark.bench.papers.criteria import Criterion, passing_scenes, read_criteria, read_values
from trackmark.bench.papers.measures import typed_options
from trackmark.datasets.spec_string import parse_text

N_SCENES = 40
"""Default number of measured scenes per sequence."""

CLIPS = "nguyen2002/clips"
"""Sequence whose scene is a set of clips."""


def measure(criterion: Criterion, scene: SceneImages | ClipSet) -> float:
    """Measure a criterion on a scene by the function of the paper's module, or of `shared`."""
    name, options = parse_text(criterion.measure)
    paper_criteria = importlib.import_module(
        f"tools.criteria.{criterion.sequence.partition('/')[0]}"
    )
    function = getattr(paper_criteria, name, None) or getattr(shared, name)
    return float(function(scene, **typed_options(function, options)))


def check_scene(sequence: str, scene: int, criteria: list[Criterion]) -> pd.DataFrame:
    """Measure criteria of a sequence on a scene; the result has the columns of `read_values`."""
    images: SceneImages | ClipSet = (
        ClipSet.load(scene)
        if sequence == CLIPS
        else SceneImages(datasets.load(f"{sequence}:scene={scene}"))
    )
    values = [measure(criterion, images) for criterion in criteria]
    passes = [criterion.passes(value) for criterion, value in zip(criteria, values, strict=True)]
    names = [criterion.name for criterion in criteria]
    columns = {"sequence": sequence, "scene": scene, "name": names}
    return pd.DataFrame({**columns, "value": values, "passes": passes})


def check_paper(
    paper: str, n_scenes: int, jobs: int, *, only: str = "", first_scene: int | None = None
) -> pd.DataFrame:
    """Measure a paper's criteria on the first scenes of each sequence.

    `only`: part of the names of the checked sequences. `first_scene`: replaces the first scene of
    `criteria.toml`.
    """
    first_scenes, criteria = read_criteria(paper)
    pending = []
    with ProcessPoolExecutor(jobs) as pool:
        for sequence, frozen in first_scenes.items():
            if only in sequence:
                of_sequence = [row for row in criteria if row.sequence == sequence]
                start = frozen if first_scene is None else first_scene
                pending += [
                    pool.submit(check_scene, sequence, scene, of_sequence)
                    for scene in range(start, start + n_scenes)
                ]
        return pd.concat([future.result() for future in pending], ignore_index=True)


def write_values(paper: str, values: pd.DataFrame) -> None:
    """Write the values of a paper's criteria to `criteria.csv`."""
    passes = values["passes"].map({True: "yes", False: "no"})
    values.assign(passes=passes).to_csv(
        paper_file(paper, "criteria.csv"), index=False, float_format="%.4g", lineterminator="\n"
    )


def summary(criteria: list[Criterion], values: pd.DataFrame) -> str:
    """Return median, range and number of passing scenes of each criterion as text."""
    lines = []
    for criterion in criteria:
        is_measured = values["sequence"].eq(criterion.sequence) & values["name"].eq(criterion.name)
        measured = values[is_measured]
        if len(measured):
            value = measured["value"]
            lines.append(
                f"{criterion.sequence:38} {criterion.name:50} median {value.median():.3g} "
                f"[{value.min():.3g}, {value.max():.3g}] target {criterion.target or '-'}: "
                f"{measured['passes'].sum()} of {len(measured)}"
            )
    for sequence, measured in values.groupby("sequence", sort=False):
        passing = passing_scenes(values, str(sequence))
        checked = measured["scene"].nunique()
        lines.append(f"{sequence}: {len(passing)} of {checked} scenes meet all criteria")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure a paper's criteria, print their summary and, with `--write`, store `criteria.csv`."""
    parser = argparse.ArgumentParser(prog="python -m tools.scene_check")
    parser.add_argument("paper")
    parser.add_argument("--scenes", type=int, default=N_SCENES, help="scenes per sequence")
    parser.add_argument("--first", type=int, help="number of the first scene")
    parser.add_argument(
        "--only", default="", help="check only sequences with this text in the name"
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--write", action="store_true", help="write criteria.csv")
    arguments = parser.parse_args()
    values = check_paper(
        arguments.paper,
        arguments.scenes,
        arguments.jobs,
        only=arguments.only,
        first_scene=arguments.first,
    )
    first_scenes, criteria = read_criteria(arguments.paper)
    sys.stdout.write(summary(criteria, values))
    if arguments.write:
        if arguments.only:
            stored = read_values(arguments.paper)
            values = pd.concat([values, stored[~stored["sequence"].isin(values["sequence"])]])
        order = values["sequence"].map([*first_scenes].index)
        write_values(arguments.paper, values.iloc[order.argsort(kind="stable")])


if __name__ == "__main__":
    main()
