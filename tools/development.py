"""Runs on development data, from which the defaults of a paper's trackers are chosen.

`python -m tools.development PAPER` runs the variants of `development.toml` on scenes from 100 on
and on recordings, and prints their means and the outcome of the rule. With `--write` it stores the
means in `development.csv`. Stored runs in `--results-root` are not repeated.

The rule: a value may differ from the text only for a reason that is no result, and only if it is
not `worse` by `rules.decide`, neither on the scenes nor on the recordings. Of several values that
are equally founded, the one with the best mean is taken. Scenes and recordings have equal weights
in this mean.
"""

import argparse
import sys
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path

import pandas as pd

from trackmark import datasets
from trackmark.bench.execution.executor import Execution
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import paper_file
from trackmark.bench.papers.cases import PaperSequence, PaperTracker
from trackmark.bench.papers.development import (
    ALL,
    FIRST_SCENE,
    Candidate,
    Development,
    Variant,
    read_development,
    registered_names,
    together,
    variants,
)
from trackmark.bench.papers.measures import Measure, mean_overlap
from trackmark.bench.papers.paper import Paper, read_paper
from trackmark.bench.papers.runs import PaperRuns
from trackmark.bench.statistics.rules import CLAIM_MARGIN, decide
from trackmark.bench.store.database import RunKey
from trackmark.datasets.spec_string import format_text, parse_text

SAMPLES = ("samples/face", "samples/bow-tie")
"""Recordings in the repository."""

RECORDINGS = (
    "vot/bag",
    "vot/ball",
    "davis/JPEGImages/480p/libby",
    "davis/JPEGImages/480p/blackswan",
    "davis/JPEGImages/480p/drift-straight",
)
"""Recordings of VOT and DAVIS, in the folder `--recordings`."""

UNIT = ["data", "sequence", "unit"]
"""Columns that identify a statistical unit: a scene, or a recording."""


@dataclass(frozen=True)
class VariantRun:
    """Runs of one variant of a tracker on one scene, or on one recording."""

    data: str  # `scenes` or `recordings`
    sequence: str
    unit: str  # specification of the scene or the recording
    tracker: PaperTracker
    variant: Variant
    spec: str  # of the tracker


def scene_specs(sequence: PaperSequence, n_scenes: int) -> list[str]:
    """Return the specifications of the development scenes of all members of a sequence."""
    specs = []
    for member in sequence.members:
        name, options = parse_text(member)
        scenes = range(FIRST_SCENE, FIRST_SCENE + n_scenes)
        specs += [format_text(name, {**options, "scene": scene}) for scene in scenes]
    return specs


def planned_runs(
    paper: Paper, development: Development, recordings: Iterable[str]
) -> Iterator[VariantRun]:
    """Yield all runs; equal parameters of a tracker have one specification."""
    specs: dict[tuple[str, str, str], str] = {}
    paths = {datasets.load(path).name: path for path in recordings}
    for name in development.skipped_recordings:
        paths.pop(name, None)
    for runs in development.runs:
        tracker = runs.tracker
        options = {key: value for key, value in tracker.options.items() if key != "init"}
        on_boxes = replace(tracker, options=options)
        for variant in variants(paper, development, tracker):
            spec = _common_spec(variant.spec(tracker), specs)
            for sequence in runs.sequences:
                for scene in scene_specs(sequence, variant.n_scenes):
                    yield VariantRun("scenes", sequence.name, scene, tracker, variant, spec)
            if not variant.on_recordings or not runs.recordings:
                continue
            spec = _common_spec(variant.spec(on_boxes), specs)
            for name, path in paths.items():
                yield VariantRun("recordings", name, path, tracker, variant, spec)


def _common_spec(spec: str, specs: dict[tuple[str, str, str], str]) -> str:
    parsed = parse_tracker(spec)
    values = str(sorted(parsed.parameters.items()))
    return specs.setdefault((parsed.name, values, parsed.init), spec)


def execute(planned: list[VariantRun], paper: Paper, root: Path, jobs: int) -> PaperRuns:
    """Execute the missing runs, and return all runs.

    All trackers of a sequence share an experiment, so that each of its images is made once.
    """
    sequences: dict[tuple[str, ...], dict[str, None]] = {}
    for unit in dict.fromkeys(run.unit for run in planned):
        specs = tuple(dict.fromkeys(run.spec for run in planned if run.unit == unit))
        sequences.setdefault(specs, {})[unit] = None
    keys: dict[str, Collection[RunKey]] = {}
    for number, (specs, units) in enumerate(sequences.items(), 1):
        name = f"development-{paper.name}-{number}"
        experiment = Experiment(name, specs, tuple(map(SequenceSpec, units)))
        execution = Execution(experiment, root, jobs)
        sys.stderr.write(f"{experiment.name}: {execution.tasks.n_runs} runs\n")
        for _ in execution.rows():
            pass
        execution.raise_errors()
        keys[experiment.name] = execution.plan.requested
    return PaperRuns(root, keys, paper.frame_rules)


def measured_values(planned: list[VariantRun], runs: PaperRuns, measure: Measure) -> pd.DataFrame:
    """Return one row per run: columns of `UNIT`, registered name, tracker, variant, value."""
    rows = []
    for run in planned:
        measured = runs.measured_run(run.spec, run.unit)
        assert measured is not None
        if run.data == "scenes":
            value = measure(measured)
        else:
            rules = replace(measured.rules, trajectory="online")
            value = mean_overlap(replace(measured, rules=rules))
        tracker = run.tracker
        rows.append(
            {
                "data": run.data,
                "sequence": run.sequence,
                "unit": run.unit,
                "registered": tracker.registered_name,
                "tracker": tracker.name,
                "variant": run.variant.name,
                "reference": run.variant.reference,
                "measure": measure.spec if run.data == "scenes" else mean_overlap.__name__,
                "value": value,
            }
        )
    return pd.DataFrame(rows)


def effects(values: pd.DataFrame) -> pd.DataFrame:
    """Return means and differences; columns as in `read_effects`.

    A unit is a scene or a recording. In rows on all sequences its value is the mean over the
    paper's trackers with a registered name.
    """
    by_name = values.assign(tracker=values["registered"])
    keys = ["data", "tracker", "variant", "reference", "measure"]
    of_names = by_name.groupby([*keys, "sequence", "unit"], sort=False)["value"].mean()
    rows = [
        *_rows(values.assign(group=values["sequence"])),
        *_rows(of_names.reset_index().assign(group=ALL)),
    ]
    return pd.DataFrame(rows)


def _rows(values: pd.DataFrame) -> Iterator[dict[str, object]]:
    """Yield a row per group of sequences, tracker and variant."""
    by_variant = {
        key: rows.set_index(["sequence", "unit"])["value"]
        for key, rows in values.groupby(["data", "group", "tracker", "variant"], sort=False)
    }
    described = values.drop_duplicates(["data", "group", "tracker", "variant"])
    for row in described.to_dict("records"):
        data, group, tracker = row["data"], row["group"], row["tracker"]
        own = by_variant[data, group, tracker, row["variant"]]
        result = {
            "data": data,
            "sequence": group,
            "tracker": tracker,
            "variant": row["variant"],
            "measure": row["measure"],
            "value": own.mean(),
            "n": len(own),
            "reference": row["reference"],
            "difference": nan,
            "low": nan,
            "high": nan,
            "decision": "",
        }
        if row["reference"]:
            other = by_variant[data, group, tracker, row["reference"]]
            decision = decide((own - other[own.index]).to_numpy(), CLAIM_MARGIN)
            result["difference"] = decision.mean
            if decision.interval:
                result["low"], result["high"] = decision.interval
                result["decision"] = decision.label
        yield result


def outcomes(paper: Paper, development: Development, table: pd.DataFrame) -> list[str]:
    """Return the outcome of the rule for each step and each candidate, one line each."""
    of_all = table[table["sequence"] == ALL]
    lines = []
    for name in registered_names(development):
        by_variant = dict(iter(of_all[of_all["tracker"] == name].groupby("variant", sort=False)))
        for step in paper.steps(name):
            is_worse = "worse" in {*by_variant[together(step)]["decision"]}
            outcome = "refused, because it is worse" if is_worse else "allowed"
            lines.append(f"{name}: {step.parameter}={step.recommended}: {outcome}")
        lines += [
            f"{name}: {candidate.name}: {_outcome(candidate, by_variant[candidate.name])}"
            for candidate in development.candidates
            if candidate.name in by_variant
        ]
    return lines


def _outcome(candidate: Candidate, rows: pd.DataFrame) -> str:
    """Return the outcome of the rule for a candidate by its rows on all scenes and recordings."""
    if not candidate.reason:
        difference = rows.loc[rows["data"] == "scenes", "difference"].item()
        moves = "moves" if abs(difference) > CLAIM_MARGIN else "does not move"
        return f"choice that {moves} the main measure"
    if "worse" in {*rows["decision"]} or rows["difference"].mean() <= 0:
        return "not taken"
    return "taken, because it is not worse and has the best mean"


def summary(table: pd.DataFrame) -> str:
    """Return the rows on all sequences as text."""
    shown = table[table["sequence"] == ALL].drop(columns=["sequence", "measure"])
    return str(shown.to_string(index=False, float_format="%.3f", na_rep="", max_colwidth=44)) + "\n"


def main() -> None:
    """Run the variants, print their means and, with `--write`, store `development.csv`."""
    parser = argparse.ArgumentParser(prog="python -m tools.development")
    parser.add_argument("paper")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--scenes", type=int, help="scenes per sequence, instead of the file's")
    parser.add_argument("--recordings", type=Path, help="folder with the recordings of VOT, DAVIS")
    parser.add_argument("--results-root", type=Path, default=Path("out/development"))
    parser.add_argument("--write", action="store_true", help="write development.csv")
    arguments = parser.parse_args()
    if arguments.write and (arguments.recordings is None or arguments.scenes):
        parser.error("--write requires all data: give --recordings, and omit --scenes")
    paper = read_paper(arguments.paper)
    development = read_development(paper)
    if arguments.scenes:
        development = development.model_copy(update={"scenes": arguments.scenes})
    folder = arguments.recordings
    recordings = [*SAMPLES, *(str(folder.absolute() / path) for path in RECORDINGS if folder)]
    planned = list(planned_runs(paper, development, recordings))
    runs = execute(planned, paper, arguments.results_root, arguments.jobs)
    table = effects(measured_values(planned, runs, development.measure))
    sys.stdout.write(summary(table))
    sys.stdout.write("\n".join(outcomes(paper, development, table)) + "\n")
    if arguments.write:
        table.to_csv(
            paper_file(paper.name, "development.csv"),
            index=False,
            float_format="%.4g",
            lineterminator="\n",
        )


if __name__ == "__main__":
    main()
