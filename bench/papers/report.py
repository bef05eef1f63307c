"""From stored runs and what was measured on the scenes to a paper's report."""

import importlib
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.conclusion import Conclusion
from bench.claims.evaluation import NOT_RUN, judge_all
from bench.claims.findings import Check
from bench.claims.kinds import Value
from bench.claims.ledger import Claim, read_claims
from bench.claims.readings import Readings
from bench.claims.sides import Table as Lookup
from bench.evaluation.record import Run
from bench.experiments.contestant import contestant
from bench.experiments.experiment import Experiment, ExperimentError
from bench.papers import Asked, Effort, Report
from bench.papers.description import Description, TableEntry
from bench.papers.drawing import write_pictures
from bench.papers.measures import Course, known_series
from bench.papers.recorded import Recorded, read_published
from bench.papers.runs import tidy_runs
from bench.papers.scene_checks import SceneCheck, measured_on_scenes
from bench.papers.selection import affordable, with_recorded
from bench.papers.stored import StoredRuns
from bench.papers.tables import beside_ours, make_table, text_table
from bench.papers.timed import failed_passes, undisturbed_lacking
from bench.papers.wording import Wording
from bench.store.truth import StoredTruth
from datasets.text_form import format_text, parse_text
from reports.ledger import ledger_table
from reports.tables import MISSING, Table
from trackers import TrackerError

__all__ = ["Context", "DescribedPaper"]


@dataclass(frozen=True)
class Context:
    """What is known of a reproduction, for tables, figures and a paper's own functions.

    Attributes
    ----------
    description : Description
        Of the paper.
    claims : mapping of str to Claim
        Its ledger.
    results, folder : Path
        Folder of all experiments, and that of the report.
    effort : Effort
        How much was asked for.
    asked : mapping of str to collection of Cell
        Runs that are meant, by experiment.
    scores : DataFrame
        See `bench.papers.runs.tidy_runs`; `experiments` (names between commas), `copied`.
    tables : dict of str to DataFrame
        What was measured beside the runs, by name.
    conclusions : list of Conclusion
        Of all claims, once they are judged.
    """

    description: Description
    claims: Mapping[str, Claim]
    results: Path
    folder: Path
    effort: Effort
    asked: Asked
    scores: pd.DataFrame
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    conclusions: list[Conclusion] = field(default_factory=list)

    @property
    def readings(self) -> Readings:
        """Of the ledger."""
        return next(iter(self.claims.values())).readings

    @cached_property
    def stored(self) -> StoredRuns:
        """Runs themselves."""
        return StoredRuns(self.results, self.asked)

    @cached_property
    def lookup(self) -> Lookup:
        """The scores, to look trackers up in."""
        return Lookup(self.scores, self.readings)

    @property
    def wording(self) -> Wording:
        """Words of trackers and settings."""
        return Wording(self.description)

    def text_of(
        self, tracker: str, sequence: str, further: Mapping[str, Value] | None = None
    ) -> str | None:
        """A tracker's text form with what is usual on a sequence; None for what there is not."""
        name, own = parse_text(tracker)
        usual = self.readings.usual.get(sequence, {}).get(name, {})
        text = format_text(name, {**usual, **(further or {}), **own})
        try:
            return contestant(text).label
        except TrackerError:
            return None

    def series(self, name: str, run: Run, truth: StoredTruth, sequence: str) -> NDArray[np.float64]:
        """A series of a run by frame."""
        course = Course(run, truth, sequence, self.description.tolerance)
        return known_series(name, further(self.description.name, "SERIES"))(course)

    def across(
        self, tracker: str, sequence: str, further: Mapping[str, Value], parameter: str
    ) -> pd.DataFrame:
        """Runs of a tracker with any value of a parameter, where there are several."""
        name, own = parse_text(tracker)
        numbers = self.scores.loc[self.scores["tracker"] == name, parameter].dropna().unique()
        pieces = [
            self.lookup.runs(name, {**further, **own, parameter: _short(number)}, [sequence])
            for number in sorted(numbers)
        ]
        found = pd.concat(pieces) if pieces else self.scores.iloc[:0]
        return found if len(found[parameter].unique()) > 1 else found.iloc[:0]


def _short(number: Any) -> Any:
    return int(number) if float(number).is_integer() else float(number)


def _module(paper: str, name: str) -> ModuleType | None:
    """A module of a paper's own; None where it has none."""
    if not (Path(__file__).parent / paper / f"{name}.py").is_file():
        return None
    return importlib.import_module(f"bench.papers.{paper}.{name}")


def further(paper: str, name: str, module: str = "measures") -> Any:
    """Something of a paper's own module; empty where it has none."""
    return getattr(_module(paper, module), name, {})


def hook(paper: str, name: str) -> Callable[[Context], Any]:
    """A paper's own function, by `module.function`.

    Raises
    ------
    ExperimentError
        Where there is none.
    """
    module, _, function = name.rpartition(".")
    found = getattr(_module(paper, module), function, None)
    if found is None:
        raise ExperimentError(f"bench/papers/{paper}/paper.toml: there is no function {name!r}.")
    return found  # type: ignore[no-any-return]  # a module's


class DescribedPaper:
    """A paper whose `paper.toml` says what is run and shown; see `bench.papers.Paper`.

    Parameters
    ----------
    description : Description
        What it says.
    """

    def __init__(self, description: Description) -> None:
        self.description = description
        self.claims = read_claims(description.name)

    @property
    def recorded(self) -> Recorded | None:
        """What is run on recorded sequences."""
        entry = self.description.recorded
        if entry is None:
            return None
        name = self.description.experiment("recorded")
        return Recorded(name=name, title=entry.title, trackers=entry.trackers, others=entry.others)

    def experiments(self, effort: Effort) -> Sequence[Experiment]:
        """See `bench.papers.Paper`."""
        entry = self.description.experiments
        names = entry.always + (entry.all if effort.everything else ())
        if effort.quick:
            names = tuple(name for name in names if name not in entry.not_quick)
        chosen = self._affordable(names, effort)
        if effort.everything and not effort.quick:
            least = {self.description.experiment(k): v for k, v in entry.thorough.items()}
            chosen = [_thorough(one, least.get(one.name, 1), effort) for one in chosen]
        return with_recorded(chosen, effort, self.recorded) if self.recorded else chosen

    def _affordable(self, names: Sequence[str], effort: Effort) -> list[Experiment]:
        full, entry = self.description.experiment, self.description.experiments
        scenes = {full(name): number for name, number in entry.quick_scenes.items()}
        return affordable([full(name) for name in names], effort, scenes, entry.quick_knobs)

    def prepare(self, folder: Path, effort: Effort) -> None:
        """See `bench.papers.Paper`: measures on scenes what no run shows."""
        self._on_scenes(folder, effort)

    def report(self, results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
        """See `bench.papers.Paper`."""
        name = self.description.name
        timed = [self.description.experiment(one) for one in self.description.experiments.timed]
        left = {*timed, self.recorded.name if self.recorded else ""}
        scores = self._scores(results, {k: v for k, v in asked.items() if k not in left})
        measured = self._on_scenes(folder, effort)
        if gate := further(name, "kept", "scenes"):
            scores["kept_scene"] = scores["name"].map(gate(measured)).fillna(True).astype(bool)
        context = Context(
            self.description, self.claims, results, folder, effort, asked, scores, measured
        )
        for module in ("timing", "measures"):
            tables = further(name, "tables", module)
            context.tables.update(tables(context) if tables else {})
        checks = further(name, "CHECKS") or dict[str, Check]()
        context.conclusions.extend(judge_all(self.claims, context.scores, context.tables, checks))
        published = further(name, "published")
        from bench.papers.figures import draw_figure  # which needs `Context`

        plots: dict[str, Any] = {}
        for figure, entry in self.description.figure.items():
            made = hook(name, entry.hook)(context) if entry.hook else draw_figure(entry, context)
            plots |= made if isinstance(made, dict) else {figure: made}
        failed = [
            line
            for one in timed
            if one in asked
            for told in (failed_passes, undisturbed_lacking)
            for line in told(results / one, asked[one])
        ]
        pictures = write_pictures(folder, plots)
        tables, rows = self._tables(context), published(context) if published else []
        return Report(
            title=self.description.title,
            remarks=self._remarks(scores, effort, plots, failed),
            tables=tables,
            rows=rows,
            claims=[one.for_json() for one in context.conclusions],
            pictures=pictures,
            main=self._main(tables, rows),
        )

    def _main(self, tables: Sequence[Table], rows: Sequence[Mapping[str, Any]]) -> Table | None:
        """What a reader of the paper looks for first: its numbers beside ours, or a table."""
        found = [row for row in rows if row["table"] in self.description.main]
        if found:
            return beside_ours("main", found)
        return next((table for table in tables if table.name in self.description.main), None)

    def _scores(self, results: Path, asked: Asked) -> pd.DataFrame:
        """All runs once, and what they are copies of; `experiments` says where they stand."""
        name = self.description.name
        series, of_run = further(name, "SERIES"), further(name, "of_run") or None
        pieces = [
            tidy_runs(results / one, cells, self.description, series, of_run).assign(
                experiments=f",{one},"
            )
            for one, cells in asked.items()
        ]
        runs = pd.concat(pieces, ignore_index=True)
        keys = ["text", "name", "repetition", "trace"]
        # Several experiments have some runs; equal text means equal boxes.
        runs["experiments"] = runs.groupby(keys, sort=False)["experiments"].transform("".join)
        runs = runs.drop_duplicates(keys, ignore_index=True).assign(copied=False)
        more = further(name, "scores")
        return more(runs) if more else runs

    def _on_scenes(self, folder: Path, effort: Effort) -> dict[str, pd.DataFrame]:
        name = self.description.name
        module, entry = _module(name, "scenes"), self.description.scenes
        if module is None or entry is None:
            return {}
        asked = {*self.description.experiments.always}
        asked |= {*self.description.experiments.all} if effort.everything else set()
        chosen = self._affordable([one for one in entry.of if one in asked], effort)
        texts = [source.text for one in chosen for source in one.sequences]
        if effort.quick and entry.quick:
            texts = [text for text in texts if parse_text(text)[0] in entry.quick]
        names = list(dict.fromkeys([*texts, *entry.further]))
        folder.mkdir(parents=True, exist_ok=True)
        jobs = effort.jobs or os.cpu_count() or 1
        if hasattr(module, "measured"):  # in its own way
            return dict(module.measured(names, folder, jobs))
        checks: Sequence[SceneCheck] = module.CHECKS
        source = Path(str(module.__file__))
        return measured_on_scenes(
            checks,
            source,
            names,
            folder,
            jobs,
            quick=effort.quick,
            everything=effort.everything,
        )

    def _tables(self, context: Context) -> list[Table]:
        name, conclusions = self.description.name, context.conclusions
        kept = bool(context.scores["kept_scene"].all())
        tables = [
            ledger_table([one.for_json() for one in conclusions], gated=not kept),
            verdicts_table(conclusions, context.readings, self.description.verdicts),
        ]
        for key, entry in self.description.table.items():
            if entry.effort == "all" and not context.effort.everything:
                continue
            tables += _made(key, entry, context, name)
        recorded = self.recorded
        if recorded and recorded.name in context.asked:
            path = context.effort.published
            published = {} if path is None else read_published(path)
            cells = context.asked[recorded.name]
            tables.append(recorded.table(context.results / recorded.name, published, cells))
        return tables

    def _remarks(
        self, scores: pd.DataFrame, effort: Effort, plots: Mapping[str, Any], timed: Sequence[str]
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
        remarks = [f"MARKED: {effort.words}."] if effort.words else []
        remarks += [remark.format(**known) for remark in self.description.remarks]
        lacking = [one for one in plots if plots[one] is None]
        if lacking:
            remarks.append(f"Not drawn, for want of finished runs: {', '.join(lacking)}.")
        failed = scores[(scores["failure"] != "") & ~scores["copied"]]
        if len(failed):
            remarks.append(
                f"FAILED: {len(failed)} of {(~scores['copied']).sum()} runs. Tables show them; a "
                "verdict leaves out the scenes in which a run that it compares failed."
            )
        return [*remarks, *(f"failed: {line}" for line in failed["failure"]), *timed]


def _made(key: str, entry: TableEntry, context: Context, paper: str) -> list[Table]:
    if entry.hook:
        made = hook(paper, entry.hook)(context)
        return made if isinstance(made, list) else [made] if made is not None else []
    frames = {"scores": context.scores, **context.tables}
    table = make_table(key, entry, frames, context.description, context.lookup)
    return [] if table is None else [table]


def _thorough(experiment: Experiment, least: int, effort: Effort) -> Experiment:
    repetitions = min(least, effort.seeds or least)
    return replace(experiment, repetitions=max(experiment.repetitions, repetitions))


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
    if found is None or found[1].startswith(NOT_RUN):
        return MISSING
    return found[0].replace("-", " ")
