"""A paper's report of made-up runs: everything that its files say, without a tracker or a scene.

A run has a number in [0, 1) for every measure, which depends on its tracker, its sequence, its
scene and its repetition alone, so that orders come out clearly, one way or the other. The tables
beside the scores have what claims and tables of the report ask of them.
"""

from functools import cache, partial
from itertools import product
from types import SimpleNamespace
from zlib import crc32

import numpy as np
import pandas as pd
import pytest

import datasets
from bench.claims.kinds import (
    SCORES,
    BoundTest,
    CheckTest,
    NoTest,
    PartsTest,
    RatioTest,
    SummaryTest,
    trackers_of,
)
from bench.evaluation.loop import run_in_lock_step
from bench.experiments.contestant import contestant
from bench.papers import Effort
from bench.papers.runs import labels_of
from bench.store.asked import Asked
from bench.store.results import Results
from bench.store.truth import write_truth
from datasets.text_form import parse_text

SCENES, FRAMES = 12, 100
LATER = 40  # first scene of experiments whose scenes were drawn later


@pytest.fixture
def made_up():
    """`runs(paper, measures)`, `tables(paper)`, and a report of them as text: `told(report)`."""
    return SimpleNamespace(runs=made_up_runs, tables=made_up_tables, told=told)


@pytest.fixture(scope="session")
def store_runs():
    """`store_runs(folder, trackers, sequences, repetitions=1)`: an experiment's runs, made here."""
    return stored_runs


def stored_runs(folder, trackers, sequences, repetitions=1):
    """Run trackers in this process, store the runs as those of an experiment; gives their cells."""
    results, versions = Results(folder), {}
    entries = [(contestant(text), one) for text in trackers for one in range(repetitions)]
    for sequence in map(datasets.load, sequences):
        write_truth(folder, sequence)
        for run in run_in_lock_step(entries, sequence).runs:
            assert results.write(run)
            key = run.identity
            versions[key.tracker, key.sequence, key.repetition, key.protocol] = key.version
    results.prepare(Asked(folder.name, versions))
    return set(versions)


def uniform(*keys):
    """A number in [0, 1) that depends on its keys alone."""
    return crc32("|".join(map(str, keys)).encode()) / 2**32


def uniform_by_name(names, *keys):
    """`uniform(*keys, name)` of each name."""
    begun = crc32("".join(f"{key}|" for key in keys).encode())
    return np.array([crc32(name, begun) for name in names]) / 2**32


def tests_of(claims):
    """Every generic test of a ledger."""
    for claim in claims.values():
        if isinstance(claim.test, PartsTest):
            yield from claim.test.parts.values()
        elif not isinstance(claim.test, NoTest | SummaryTest | CheckTest):
            yield claim.test


def made_up_runs(paper, measures=(), repetitions=2):
    """Runs of all scored experiments, as `tidy_runs` has them; `measures` are those of Python."""
    description, rows = paper.description, []
    counts = {"success_frames", "frames_inside", "first_loss"}
    names = sorted({*description.measures, *measures, *counts, "centre_error", "mean_overlap"})
    of_names = cache(partial(uniform_by_name, [name.encode() for name in names]))
    timed = {description.experiment(one) for one in description.experiments.timed}
    for experiment in paper.experiments(Effort(everything=True)):
        scenes = [int(parse_text(one.text)[1].get("scene", 0)) for one in experiment.sequences]
        first = min(scenes, default=0) // LATER * LATER
        for scene, source in zip(scenes, experiment.sequences, strict=True):
            if experiment.name in timed or scene >= first + SCENES:
                continue
            for text, repetition, trace in product(
                experiment.trackers, range(repetitions), description.traces or ("online",)
            ):
                labels = labels_of(text, source.text, description.apart)
                place = labels["settled"], labels["sequence"], trace
                numbers = 0.8 * of_names(*place) + 0.1 * of_names(source.text)
                numbers += 0.1 * of_names(*place, source.text, repetition)
                values = dict(zip(names, numbers.tolist(), strict=True))
                values |= {name: round(FRAMES * values[name]) for name in counts}
                rows.append(
                    {**labels, "repetition": repetition, "trace": trace, "frames": FRAMES}
                    | {"failure": "", "path": "", "experiments": f",{experiment.name},", **values}
                )
    keys = ["text", "name", "repetition", "trace"]
    runs = pd.DataFrame(rows).drop_duplicates(keys, ignore_index=True)
    return runs.assign(copied=False, kept_scene=True)


def made_up_tables(paper):
    """Tables beside the scores, with the columns and values that the paper's files name."""
    columns, metrics = {}, {}

    def asked(table, column, values=()):
        columns.setdefault(table, {}).setdefault(column, set()).update(values)

    for test in tests_of(paper.claims):
        if test.table == SCORES:
            continue
        limits = [test.where, *(trackers_of(side)[1] for side in test.sides)]
        if isinstance(test, BoundTest):
            metrics.setdefault(test.table, set()).add(test.metric)
        elif isinstance(test, RatioTest):
            metrics.setdefault(test.table, set()).update({test.longer, test.shorter})
        else:
            limits += [*test.groups.values(), {"sequence": test.on, "scene": range(SCENES)}]
            metrics.setdefault(test.table, set()).update(test.by)
            for side in test.sides:
                names = [name for name, _ in trackers_of(side)[0]]
                asked(test.table, *(["tracker", names] if names else ["sequence"]))
        for one in limits:
            for column, values in one.items():
                asked(test.table, column, values)
    for entry in paper.description.table.values():
        for line in entry.lines:
            metrics.setdefault(line.table, set()).add(line.of)
            for column in line.each:
                asked(line.table, column)
            for column, values in line.where.items():
                asked(line.table, column, values)
            known = set(columns[line.table])
            for column, values in [pair for one in entry.columns for pair in one.where.items()]:
                if column not in known:  # what claims name is enough
                    asked(line.table, column, values)
        if entry.table != SCORES:
            metrics.setdefault(entry.table, set()).update(one.of for one in entry.columns)
            for column in entry.rows:
                asked(entry.table, column)
            for column, values in [pair for one in entry.columns for pair in one.where.items()]:
                asked(entry.table, column, values)
    usual = {"preset": ["as-written", "recommended"], "sequence": ["a/b"]}
    usual |= {"window": ["fixed", "adaptive"]}
    made = {}
    for table, names in columns.items():
        values = {"scene": range(SCENES)} | {
            name: sorted(found, key=str) or usual.get(name, ["one", "two"])
            for name, found in names.items()
        }
        rows = [dict(zip(values, chosen, strict=True)) for chosen in product(*values.values())]
        for row in rows:
            label = [value for name, value in row.items() if name != "scene"]
            for metric in sorted(metrics.get(table, set()).difference(values)):
                by_label, by_scene = uniform(table, metric, *label), uniform(metric, *row.values())
                row[metric] = 0.1 + 0.7 * by_label + 0.1 * by_scene
        made[table] = pd.DataFrame(rows)
    return made


def told(report):
    """A report as text: a line a claim with all readings in which it is judged, and the tables."""
    lines = []
    for claim in report.claims:
        evidence = claim["evidence"]
        fragile = ", fragile" if evidence["fragile"] else ""
        lines.append(
            f"{claim['id']} {claim['verdict']}, all drawn {evidence['all_drawn_scenes']}: "
            f"{claim['readings'] or '-'}, post hoc {evidence['post_hoc'] or '-'}{fragile}"
        )
        readings = {}
        for one in evidence["findings"]:
            if one["light"] == "both" and one["scenes"] == "kept":
                readings.setdefault(one["reading"], []).append(one)
        for reading, found in readings.items():
            told_of = ", ".join(
                f"{one['group'] or one['metric'] or 'whole'} {one['verdict']} {one['cells']}"
                + ("" if one["statistic"] is None else f" {one['statistic']:.4f}")
                for one in found
            )
            lines.append(f"    {reading or '(no reading)'}: {told_of}")
    for table in report.tables:
        if table.name not in ("claims",):
            lines += ["", f"{table.name}: {table.caption}", " | ".join(table.heads)]
            lines += [" | ".join(cell.text for cell in row) for row in table.rows]
            lines += [f"- {note}" for note in table.notes]
    for row in report.rows:
        known = (f"{value:.4g}" for value in [row["measured"], *(row["interval"] or ())] if value)
        lines.append(f"{row['table']}: {row['label']}, {row['column']}: {row['published']} | ")
        lines[-1] += ", ".join(known)
    return "\n".join(lines) + "\n"
