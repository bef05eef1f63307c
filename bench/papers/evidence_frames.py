"""Runs that a click on a number of a page opens in the player, and frames around the worst one."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np

from trackmark import datasets
from trackmark.bench.analysis.stored_runs import StoredRun
from trackmark.bench.claims.claims_file import Claim
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.pages.content import PlayerScene
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.player_runs import PageRuns, collect_runs, scenes
from trackmark.bench.papers.description import MainRow
from trackmark.bench.papers.measures import find_measure
from trackmark.bench.papers.plan import scene_names, tracker_text
from trackmark.bench.papers.runs import Context
from trackmark.bench.store.layout import RunKey
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import run_row
from trackmark.bench.store.truth import read_truth
from trackmark.reports.charts import PlayerPosition

# kind of the worst frame, by unit of the measure; otherwise the frame with the largest error
KINDS = {"overlap": "overlap", "frames": "loss"}
MAX_FRAMES = 2400  # maximum per page: about 10 MB
MAX_SECONDS, MAX_QUICK_SECONDS = 20.0, 1.0  # maximum time to render the frames of a page
REACHES = (1_000_000, 100, 50, 20, 10, 5, 2)
"""Numbers of frames before and after a worst frame; the first within the limits is used."""


class ShownRun(NamedTuple):
    """Run that opens at its worst frame; `beside`: trackers that are drawn with it."""

    tracker: str
    sequence: str
    kind: str
    beside: tuple[str, ...]


@dataclass(frozen=True)
class Footage:
    """Rendered scenes of a page, and the position in the player that each number opens."""

    reading: PageRuns
    scenes: Sequence[PlayerScene]
    places: Mapping[ShownRun | None, PlayerPosition]


def film_runs(linked_runs: Iterable[ShownRun | None], context: Context, watch: Watch) -> Footage:
    """Read runs and those drawn next to them; render the frames around their worst frames."""
    runs = list(dict.fromkeys(filter(None, linked_runs)))
    files = [
        file
        for run in runs
        for tracker in (run.tracker, *run.beside)
        for file in context.runs.files(tracker, run.sequence)
    ]
    reading = collect_runs(_stored(dict.fromkeys(files)), [])
    places: dict[ShownRun | None, PlayerPosition] = {}
    places |= {run: place for run in runs if (place := _place(run, reading, context))}
    limit = MAX_QUICK_SECONDS if context.effort.quick else MAX_SECONDS
    frames = _frames(reading, list(places.values()), limit)
    player_scenes = [*scenes(reading, watch, selected=frames)] if files else []
    return Footage(reading, player_scenes, places)


def _stored(places: Iterable[tuple[Path, RunKey]]) -> Iterator[StoredRun]:
    truth = cache(read_truth)
    for folder, cell in places:
        results = Results(folder)
        run = results.read(cell)
        stored = truth(results.folder, run.identity.sequence, run.identity.fingerprint)
        row = run_row(run, stored)
        # The specification of a synthetic scene is its source.
        yield row | {"source": row["source"] or row["sequence"]}, run, stored


def _place(run: ShownRun, reading: PageRuns, context: Context) -> PlayerPosition | None:
    names = [parse_tracker(text).label for text in (run.tracker, *run.beside)]
    sequence, _ = datasets.identity(run.sequence)
    place = reading.place(names[0], sequence, run.kind, context.description.trace)
    trackers = sorted({reading.trackers.index(name) for name in names if name in reading.trackers})
    return place and place._replace(show=tuple(trackers))


def _frames(reading: PageRuns, places: Sequence[PlayerPosition], seconds: float) -> list[list[int]]:
    """Select frames of each sequence around the worst ones, within limits of size and time."""
    frames: list[list[int]] = []
    for reach in REACHES:
        sets: list[set[int]] = [set() for _ in reading.stages]
        for place in places:
            last = len(reading.stages[place.sequence].truth) - 1
            sets[place.sequence] |= {
                *range(max(0, place.frame - reach), min(last, place.frame + reach) + 1)
            }
        frames = [*map(sorted, sets)]
        costs = (stage.row["frame_seconds"] or 0.0 for stage in reading.stages)
        needed = sum(cost * len(its) for cost, its in zip(costs, frames, strict=True))
        if needed <= seconds and sum(map(len, frames)) <= MAX_FRAMES:
            break
    return frames


def main_runs(row: MainRow, setting: str, context: Context) -> list[ShownRun | None]:
    """Return the worst run behind each value of a row of the main table in a setting."""
    texts = [tracker_text(context.description, name, setting) for name in row.trackers]
    scenes = _scenes(row.sequences, context.scenes, context)
    return [
        _worst(text, scenes, measure, texts, context) for text in texts for measure in row.measures
    ]


def claim_run(claim: Claim, setting: str, context: Context) -> ShownRun | None:
    """Return the worst run of a claim's first tracker; None for times and values of scenes."""
    if claim.measure.startswith(("scenes.", "timing.")):
        return None
    texts = [tracker_text(context.description, name, setting) for name in claim.trackers]
    scenes = _scenes(claim.sequences, claim.n_scenes, context)
    return _worst(texts[0], scenes, claim.measure, texts, context)


def _scenes(sequences: Iterable[str], count: int, context: Context) -> list[str]:
    names = [scene_names(context.description, name, count) for name in sequences]
    return [member for sequence in names for members in sequence for member in members]


def _worst(
    text: str, scenes: Iterable[str], measured: str, beside: Sequence[str], context: Context
) -> ShownRun | None:
    """Return the run of a tracker with the worst mean over repetitions; None without runs."""
    measure = find_measure(measured, context.description.name)
    stored = {scene: context.runs.judged_runs(text, scene) for scene in scenes}
    means = {scene: float(np.mean([*map(measure, runs)])) for scene, runs in stored.items() if runs}
    means = {scene: mean for scene, mean in means.items() if isfinite(mean)}
    if not means:
        return None
    worst = (max if measure.lower_is_better else min)(means, key=means.__getitem__)
    return ShownRun(text, worst, KINDS.get(measure.unit, "centre_error"), tuple(beside))
