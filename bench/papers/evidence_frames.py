"""Runs behind a page's numbers as its player shows them, with the frames around the worst ones."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from trackmark import datasets
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.player_runs import PageRuns, collect_runs, scenes
from trackmark.bench.papers.context import Context
from trackmark.bench.papers.scene_rows import ShownRun
from trackmark.bench.reporting.stored_runs import StoredRun
from trackmark.bench.store.layout import RunKey
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import run_row
from trackmark.bench.store.truth import read_truth
from trackmark.reports.page.content import PlayerPosition, PlayerScene

MAX_FRAMES = 2400  # of a page: about ten megabytes
MAX_SECONDS, MAX_QUICK_SECONDS = 20.0, 1.0  # to render them, by the time that they once took
REACHES = (1_000_000, 100, 50, 20, 10, 5, 2)
"""Frames before and after the worst ones; the first that meets the limits is taken, or the last."""


@dataclass(frozen=True)
class Footage:
    """Filmed scenes of a page, and the places that its numbers lead to."""

    reading: PageRuns
    scenes: Sequence[PlayerScene]
    places: Mapping[ShownRun, PlayerPosition]

    def place(self, run: ShownRun | None) -> PlayerPosition | None:
        """Return the worst frame of a run; None without one."""
        return self.places.get(run) if run else None


def film_runs(
    linked_runs: Iterable[ShownRun | None], context: Context, results: Path, watch: Watch
) -> Footage:
    """Read runs with the runs drawn next to them; render the frames around their worst frames.

    Raises
    ------
    ResultsError
        If a file cannot be read.
    """
    runs = list(dict.fromkeys(filter(None, linked_runs)))
    files = [
        file
        for run in runs
        for tracker in (run.tracker, *run.beside)
        for file in context.runs.files(tracker, run.sequence)
    ]
    reading = collect_runs(_stored(dict.fromkeys(files)), [])
    places = {run: place for run in runs if (place := _place(run, reading, context))}
    limit = MAX_QUICK_SECONDS if context.effort.quick else MAX_SECONDS
    frames = _frames(reading, list(places.values()), limit)
    filmed = [*scenes(reading, str(results), watch, selected=frames)] if files else []
    return Footage(reading, filmed, places)


def _stored(places: Iterable[tuple[Path, RunKey]]) -> Iterator[StoredRun]:
    truth = cache(read_truth)
    for folder, cell in places:
        results = Results(folder)
        run = results.read(cell)
        stored = truth(results.folder, run.identity.sequence, run.identity.fingerprint)
        row = run_row(run, stored)
        # The name of a synthetic scene is its source.
        yield row | {"source": row["source"] or row["sequence"]}, run, stored


def _place(run: ShownRun, reading: PageRuns, context: Context) -> PlayerPosition | None:
    names = [parse_tracker(text).label for text in (run.tracker, *run.beside)]
    sequence, _ = datasets.identity(run.sequence)
    place = reading.place(names[0], sequence, run.kind, context.description.trace)
    trackers = sorted({reading.trackers.index(name) for name in names if name in reading.trackers})
    return place and place._replace(show=tuple(trackers))


def _frames(reading: PageRuns, places: Sequence[PlayerPosition], seconds: float) -> list[list[int]]:
    """Choose frames of each sequence, as far around the places as room and time allow."""
    costs = [stage.row["frame_seconds"] or 0.0 for stage in reading.stages]
    chosen: list[list[int]] = []
    for reach in REACHES:
        sets: list[set[int]] = [set() for _ in reading.stages]
        for place in places:
            last = len(reading.stages[place.sequence].truth) - 1
            near = range(max(0, place.frame - reach), min(last, place.frame + reach) + 1)
            sets[place.sequence] |= {*near}
        chosen = [sorted(frames) for frames in sets]
        took = sum(cost * len(frames) for cost, frames in zip(costs, chosen, strict=True))
        if took <= seconds and sum(map(len, chosen)) <= MAX_FRAMES:
            break
    return chosen
