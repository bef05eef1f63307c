"""Runs that a click on a number of a page opens in the player, and frames around the worst one."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

from trackmark import datasets
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.pages.content import PlayerSequence
from trackmark.bench.pages.page_frames import Progress, with_frames
from trackmark.bench.pages.player_runs import PageRuns, collect_runs
from trackmark.bench.papers.cases import Case
from trackmark.bench.papers.claims import Claim
from trackmark.bench.papers.measures import Measure
from trackmark.bench.papers.paper import MainRow
from trackmark.bench.papers.runs import Context
from trackmark.bench.store.database import run_key
from trackmark.reports.charts import PlayerPosition

# kind of the worst frame, by unit of the measure; otherwise the frame with the largest error
KINDS = {"overlap": "overlap", "frames": "loss"}
MAX_FRAMES = 2400  # maximum per page: about 10 MB
MAX_SECONDS, MAX_QUICK_SECONDS = 20.0, 1.0  # maximum time to render the frames of a page
REACHES = (1_000_000, 100, 50, 20, 10, 5, 2)
"""Numbers of frames before and after a worst frame; the first within the limits is used."""


class ShownRun(NamedTuple):
    """Run that opens at the worst frame by the criterion; `beside` names trackers drawn with it."""

    tracker: str
    sequence: str
    criterion: str
    beside: tuple[str, ...]


@dataclass(frozen=True)
class PlayerContent:
    """Rendered scenes of a page, and the position in the player that each number opens."""

    reading: PageRuns
    sequences: Sequence[PlayerSequence]
    links: Mapping[ShownRun | None, PlayerPosition]


def player_content(
    linked_runs: Iterable[ShownRun | None], context: Context, progress: Progress
) -> PlayerContent:
    """Read runs and those drawn next to them; render the frames around their worst frames."""
    runs = list(dict.fromkeys(filter(None, linked_runs)))
    stored_runs = {
        run_key(stored_run.row): stored_run
        for run in runs
        for tracker in (run.tracker, *run.beside)
        if (stored_run := context.runs.stored_run(tracker, run.sequence))
    }
    reading = collect_runs(
        # The specification of a synthetic scene is its source.
        (
            stored_run._replace(row={**row, "source": row["source"] or row["sequence"]})
            for stored_run in stored_runs.values()
            for row in [stored_run.row]
        ),
        [],
    )
    links: dict[ShownRun | None, PlayerPosition] = {}
    links |= {run: position for run in runs if (position := _position(run, reading, context))}
    limit = MAX_QUICK_SECONDS if context.options.quick else MAX_SECONDS
    frames = _frames(reading, list(links.values()), limit)
    sequences = with_frames(reading.sequences, progress, selected=frames)
    return PlayerContent(reading, sequences, links)


def _position(run: ShownRun, reading: PageRuns, context: Context) -> PlayerPosition | None:
    names = [parse_tracker(spec).label for spec in (run.tracker, *run.beside)]
    sequence, _ = datasets.name_and_fingerprint(run.sequence)
    position = reading.worst_position(names[0], sequence, run.criterion, context.paper.trajectory)
    trackers = sorted({reading.trackers.index(name) for name in names if name in reading.trackers})
    return position and position._replace(show=tuple(trackers))


def _frames(
    reading: PageRuns, positions: Sequence[PlayerPosition], seconds: float
) -> list[list[int]]:
    """Select frames of each sequence around the worst ones, within limits of size and time."""
    frames: list[list[int]] = []
    for reach in REACHES:
        sets: list[set[int]] = [set() for _ in reading.sequences]
        for position in positions:
            last = reading.sequences[position.sequence].n_frames - 1
            sets[position.sequence] |= {
                *range(max(0, position.frame - reach), min(last, position.frame + reach) + 1)
            }
        frames = [*map(sorted, sets)]
        costs = (sequence.row["reading_seconds"] or 0.0 for sequence in reading.sequences)
        needed = sum(
            cost * len(of_sequence) for cost, of_sequence in zip(costs, frames, strict=True)
        )
        if needed <= seconds and sum(map(len, frames)) <= MAX_FRAMES:
            break
    return frames


def main_runs(row: MainRow, setting: str, context: Context) -> list[ShownRun | None]:
    """Return the worst run behind each value of a row of the main table in a setting."""
    if row.sequence is None:
        return []
    specs = tuple(tracker.spec(setting) for tracker in row.trackers)
    return [
        _worst([context.case(tracker, row.sequence, setting)], measure, specs, context)
        for tracker in row.trackers
        for measure in row.measures
    ]


def claim_run(claim: Claim, setting: str, context: Context) -> ShownRun | None:
    """Return the worst run of a claim's first tracker; None for values of scenes."""
    if claim.measure.subject != "run":
        return None
    specs = tuple(tracker.spec(setting) for tracker in claim.all_trackers)
    of_first = claim.sides(setting)[0][: len(claim.sequences)]
    return _worst(of_first, claim.measure, specs, context)


def _worst(
    row_cases: Iterable[Case], measure: Measure, beside: tuple[str, ...], context: Context
) -> ShownRun | None:
    """Return the run of a tracker with the worst value; None without runs."""
    values = {
        (case.tracker, scene): measure(measured)
        for case in row_cases
        for scene in case.scenes_of_members
        if (measured := context.runs.measured_run(case.tracker, scene))
    }
    finite = {run: value for run, value in values.items() if isfinite(value)}
    if not finite:
        return None
    tracker, scene = (max if measure.lower_is_better else min)(finite, key=finite.__getitem__)
    return ShownRun(tracker, scene, KINDS.get(measure.unit, "centre_error"), beside)
