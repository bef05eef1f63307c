"""A paper as its folder describes it: what is run, and the report of what came out."""

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from bench.claims.conclusion import Conclusion
from bench.claims.judging import NOT_RUN, is_tested, judge_all
from bench.claims.kinds import SummaryTest
from bench.claims.ledger import read_claims
from bench.claims.readings import Readings
from bench.experiments.experiment import Experiment
from bench.papers import NO_EVIDENCE, Asked, Effort, Report
from bench.papers.context import Context, hook, own_module, part_of
from bench.papers.description import Description, TableEntry
from bench.papers.figures import Drawn, caption_of, draw_figure, write_pictures
from bench.papers.grounds import all_grounds
from bench.papers.recorded import RECORDED, read_published
from bench.papers.runs import tidy_runs
from bench.papers.scenes import examined, measured_on_scenes
from bench.papers.screen import claim_count
from bench.papers.selection import (
    affordable,
    experiments_of,
    more_scenes,
    more_to_run,
    with_recorded,
)
from bench.papers.tables import beside_ours, make_table, text_table
from bench.papers.timing import failed_passes, runs_lacking
from bench.store.layout import Cell
from datasets.text_form import parse_text
from reports.ledger import ledger_table
from reports.tables import MISSING, Table

__all__ = ["AMOUNT", "Paper"]

WORTH_WORKERS = 3000
"""Runs from which on workers, which take seconds to start, read them sooner."""

AMOUNT = "How much was run: "
"""Where a remark on less than all begins."""

JUDGED = (
    "Effects have 95 % intervals; a difference is positive where it is as the claim has it. A "
    "claim of k parts shows the one that decides, and does not hold if a part fails with its "
    'interval at 1 - .05/k. No correction is applied across claims: expect one false "does not '
    'hold" among 40 claims that are only just true (docs/verdicts.md).'
)


class Paper:
    """What `trackmark reproduce` runs and reports, as a paper's `paper.toml` says it."""

    def __init__(self, description: Description) -> None:
        self.description = description
        self.claims = read_claims(description.name)
        self._measured: dict[tuple[Path, Effort], dict[str, pd.DataFrame]] = {}

    def experiments(self, effort: Effort) -> Sequence[Experiment]:
        """Experiments to run, in order.

        Raises
        ------
        ExperimentError, SequenceError
            For anything asked for that can be known to fail.
        """
        return with_recorded(experiments_of(self.description, effort), self.description, effort)

    def prepare(self, folder: Path, effort: Effort) -> None:
        """Measure on scenes what no run shows, before any tracker runs; the report's folder."""
        self._measured[folder, effort] = self._on_scenes(folder, effort)

    def report(self, results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
        """Judge the runs in `results` that were asked for now, write pictures into `folder`."""
        name = self.description.name
        timed = [self.description.experiment(one) for one in self.description.experiments.timed]
        left = {*timed, self.description.experiment(RECORDED)}
        jobs = effort.jobs or os.cpu_count() or 1
        scores = self._scores(results, {k: v for k, v in asked.items() if k not in left}, jobs)
        # To look it up again takes half a minute where scenes take long to open.
        measured = self._measured.pop((folder, effort), None) or self._on_scenes(folder, effort)
        if gate := part_of(name, "kept", "scenes"):
            scores["kept_scene"] = scores["name"].map(gate(measured)).fillna(True).astype(bool)
        context = Context(
            self.description, self.claims, results, folder, effort, asked, scores, measured
        )
        for module in ("timing", "measures"):
            tables = part_of(name, "tables", module)
            context.tables.update(tables(context) if tables else {})
        checks = part_of(name, "CHECKS")
        judged = judge_all(self.claims, context.scores, context.tables, checks, asked)
        context.conclusions.extend(_advised(one, self.description, effort) for one in judged)
        plots, captions = self._plots(context)
        published = part_of(name, "published")
        tables, rows = self._tables(context), published(context) if published else []
        title = self.description.title
        tested = {key: claim for key, claim in self.claims.items() if is_tested(claim, asked)}
        return Report(
            title=f"{NO_EVIDENCE}: {title}" if effort.quick else title,
            remarks=[*self._remarks(scores, effort, plots), *self._disturbances(context)],
            tables=tables,
            rows=rows,
            claims=[one.for_json() for one in context.conclusions],
            pictures=write_pictures(folder, plots),
            main=self._main(tables, rows),
            tracking_seconds=_seconds(scores),
            captions=captions,
            grounds=all_grounds(
                tested, context.scores, context.tables, part_of(name, "together") or str
            ),
            sums={
                name: claim.test.claims
                for name, claim in self.claims.items()
                if isinstance(claim.test, SummaryTest)
            },
        )

    def _plots(self, context: Context) -> tuple[dict[str, Drawn], dict[str, tuple[str, str]]]:
        """Figures by name, None for one that there are no runs for, and their captions."""
        plots: dict[str, Drawn] = {}
        captions: dict[str, tuple[str, str]] = {}
        for name, entry in self.description.figure.items():
            if entry.hook:
                made = hook(self.description.name, entry.hook)(context)
            else:
                made = draw_figure(entry, context)
            here = made if isinstance(made, dict) else {name: made}
            plots |= here
            captions |= {
                key: caption_of(key, plot, entry) for key, plot in here.items() if plot is not None
            }
        return plots, captions

    def _disturbances(self, context: Context) -> list[str]:
        """What of the timing runs failed, or was disturbed."""
        names = map(self.description.experiment, self.description.experiments.timed)
        return [
            line
            for one in names
            if one in context.asked
            for told in (failed_passes, runs_lacking)
            for line in told(context.results / one, context.asked[one])
        ]

    def _main(self, tables: Sequence[Table], rows: Sequence[Mapping[str, Any]]) -> list[Table]:
        """What a reader of the paper looks for first: its numbers beside ours, and tables."""
        names = self.description.main
        found = [row for row in rows if row["table"] in names]
        left = [name for name in names if name not in {row["table"] for row in found}]
        shown = [table for name in left for table in tables if table.name == name]
        return [beside_ours("main", found), *shown] if found else shown

    def _scores(self, results: Path, asked: Asked, jobs: int) -> pd.DataFrame:
        """All runs once, and what they are copies of; `experiments` says where they stand."""
        name = self.description.name
        tidied = partial(_tidied, description=self.description, results=results)
        if jobs > 1 and sum(map(len, asked.values())) > WORTH_WORKERS:
            found = examined(tidied, [*asked.items()], jobs, "Runs read")
            made = {experiment: piece for (experiment, _), piece in found}
            pieces = [made[experiment] for experiment in asked]
        else:
            pieces = [*map(tidied, asked.items())]
        runs = pd.concat(pieces, ignore_index=True)
        keys = ["text", "name", "repetition", "trace"]
        # Several experiments have some runs; equal text means equal boxes.
        runs["experiments"] = runs.groupby(keys, sort=False)["experiments"].transform("".join)
        runs = runs.drop_duplicates(keys, ignore_index=True).assign(copied=False)
        more = part_of(name, "scores")
        return more(runs) if more else runs

    def _on_scenes(self, folder: Path, effort: Effort) -> dict[str, pd.DataFrame]:
        name = self.description.name
        module, entry = own_module(name, "scenes"), self.description.scenes
        if module is None or entry is None:
            return {}
        asked = {*self.description.experiments.always}
        asked |= {*self.description.experiments.all} if effort.everything else set()
        named = [one for one in entry.of if one in asked]
        chosen = affordable(self.description, named, effort)
        texts = [source.text for one in chosen for source in one.sequences]
        if effort.quick or not effort.everything:
            by_name: dict[str, list[str]] = {}
            for text in dict.fromkeys(texts):
                by_name.setdefault(parse_text(text)[0], []).append(text)
            few = {*(entry.few or by_name)} - {*(entry.not_quick if effort.quick else ())}
            texts = [
                text for bare in by_name if bare in few for text in by_name[bare][: entry.most]
            ]
        names = list(dict.fromkeys([*texts, *entry.further]))
        folder.mkdir(parents=True, exist_ok=True)
        jobs = effort.jobs or os.cpu_count() or 1
        if hasattr(module, "measured"):  # in its own way
            return dict(module.measured(names, folder, jobs))
        return measured_on_scenes(
            module.CHECKS,
            Path(str(module.__file__)),
            names,
            folder,
            jobs,
            quick=effort.quick,
            everything=effort.everything,
        )

    def _tables(self, context: Context) -> list[Table]:
        name, conclusions = self.description.name, context.conclusions
        claims = [one.for_json() for one in conclusions]
        begins = f"{NO_EVIDENCE}: " if context.effort.quick else ""
        kept = bool(context.scores["kept_scene"].all())
        tables = [
            ledger_table(claims, f"{begins}{claim_count(claims)}", gated=not kept),
            verdicts_table(conclusions, context.readings, self.description.verdicts),
        ]
        for key, entry in self.description.table.items():
            if entry.effort == "all" and not context.effort.everything:
                continue
            tables += _made(key, entry, context, name)
        recorded, runs = self.description.recorded, self.description.experiment(RECORDED)
        if recorded and runs in context.asked:
            path = context.effort.published
            published = {} if path is None else read_published(path)
            tables.append(recorded.table(context.results / runs, published, context.asked[runs]))
        return tables

    def _remarks(
        self, scores: pd.DataFrame, effort: Effort, plots: Mapping[str, Drawn]
    ) -> list[str]:
        gated = scores[["name", "sequence", "kept_scene"]].drop_duplicates()
        kept = gated[gated["kept_scene"]]
        known = {
            "scenes": scores["scene"].nunique(),
            "repetitions": scores["repetition"].max() + 1,
            "drawn": len(gated),
            "kept": len(kept),
            "fewest": kept.groupby("sequence").size().min(),
        }
        remarks = [f"{AMOUNT}{effort.words}."] if effort.words else []
        remarks += [remark.format(**known) for remark in self.description.remarks]
        remarks.append(JUDGED)
        lacking = [one for one in plots if plots[one] is None]
        if lacking:
            remarks.append(f"Not drawn, for want of finished runs: {', '.join(lacking)}.")
        failed = scores[(scores["failure"] != "") & ~scores["copied"]]
        if len(failed):
            remarks.append(
                f"FAILED: {len(failed)} of {(~scores['copied']).sum()} runs. Tables show them; a "
                "verdict leaves out the scenes in which a run that it compares failed."
            )
        return [*remarks, *(f"failed: {line}" for line in failed["failure"])]


def _tidied(
    asked: tuple[str, Collection[Cell]], description: Description, results: Path
) -> pd.DataFrame:
    """Runs of an experiment; the paper's own series are found by name, also in a worker."""
    series, of_run = part_of(description.name, "SERIES"), part_of(description.name, "of_run")
    runs = tidy_runs(results / asked[0], asked[1], description, series, of_run or None)
    return runs.assign(experiments=f",{asked[0]},")


def _seconds(scores: pd.DataFrame) -> float:
    """What trackers took in all runs; each has a row a trace, and copies."""
    if "seconds" not in scores:
        return 0.0
    return float(scores[~scores["copied"]].drop_duplicates("path")["seconds"].sum())


def _advised(one: Conclusion, description: Description, effort: Effort) -> Conclusion:
    """Return a conclusion with the option that runs its tests, or more scenes of them."""
    not_run = one.reason.startswith(NOT_RUN)
    told = one.reason
    words = more_to_run(one.claim, description, effort) if not_run else ""
    if not not_run and one.verdict == "inconclusive":
        words = more_scenes(one.claim, description, effort)
    return replace(one, found=replace(one.found, reason=f"{told}; {words}")) if words else one


def _made(key: str, entry: TableEntry, context: Context, paper: str) -> list[Table]:
    if entry.hook:
        made = hook(paper, entry.hook)(context)
        return made if isinstance(made, list) else [made] if made is not None else []
    frames = {"scores": context.scores, **context.tables}
    table = make_table(key, entry, frames, context.description, context.lookup)
    return [] if table is None else [table]


def verdicts_table(
    conclusions: Sequence[Conclusion],
    readings: Readings,
    choices: Mapping[str, Mapping[str, str]],
) -> Table:
    """Verdicts by these choices of readings or each axis' options; all else as the headline."""
    columns = {words: {**choice} for words, choice in choices.items()}
    for axis, options in () if choices else readings.columns.items():
        for place, name in enumerate(options):
            if place or not columns:
                mark = " (post hoc)" if readings.axes[axis].options[name].post_hoc else ""
                columns[f"{name}{mark}"] = {axis: name} if place else {}
    data = [
        {"claim": one.claim.id} | {words: _told(one, choice) for words, choice in columns.items()}
        for one in conclusions
    ]
    used = [head for head in columns if any(row[head] != MISSING for row in data)]
    return text_table(
        "verdicts",
        "Verdicts by reading, all else as in the first one",
        [{head: row[head] for head in ["claim", *used]} for row in data],
        n_labels=1,
    )


def _told(conclusion: Conclusion, choice: Mapping[str, str]) -> str:
    found = conclusion.under(choice)
    if found is None or found.reason.startswith(NOT_RUN):
        return MISSING
    return ", ".join(filter(None, [found.verdict, found.effect]))
