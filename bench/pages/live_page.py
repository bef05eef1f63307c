"""Page of trackers that are run once on a sequence, with all of their estimates."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from trackmark.bench.execution.executor import Execution
from trackmark.bench.execution.plan import RunStatus
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.operating_system import temporary_folder
from trackmark.bench.pages.content import Page, PageSection, player_link
from trackmark.bench.pages.page import write_page
from trackmark.bench.pages.page_frames import Progress, with_frames
from trackmark.bench.pages.player_runs import PageRuns, collect_runs
from trackmark.bench.store.runs import Runs

_MAX_HEIGHT = 480  # height of frames [px]; large, as the page has one sequence only


def write_live_page(
    trackers: Sequence[str],
    source: SequenceSpec,
    path: Path,
    progress: Progress,
    repetition: int = 0,
) -> tuple[list[Path], list[str]]:
    """Run trackers on a sequence in supervised processes and write a page with a player.

    The page shows boxes, masks, contours, particles, maps and the numbers of the trackers; failed
    runs end at their last frame. `progress` receives the number of frames that trackers have
    processed, then the number of frames that were read for the page. `repetition`: repetition of
    stochastic trackers, as in `run`. Returns the files of the page and the reasons of failed runs;
    the runs are not stored.

    Raises `TrackerError`, `SequenceError` or `ExperimentError` if something cannot be run, and
    `OSError` if the page cannot be written.
    """
    with temporary_folder() as folder:
        live = Experiment("live", tuple(trackers), (source,), repetition + 1, keeps_arrays=True)
        execution = Execution(live, folder)
        plan = execution.plan
        last = plan.repetitions[plan.run_trackers] - 1
        # Run only the last repetition.
        plan.statuses[:, plan.run_repetitions < last] = RunStatus.FINISHED
        specs = [*plan.trackers.values()]
        for _ in execution.rows(lambda done: progress(done, execution.tasks.work)):
            pass
        execution.raise_errors()
        counts = execution.plan.repetitions.tolist()  # larger if a tracker is stochastic after all
        latest = {spec.label: count - 1 for spec, count in zip(specs, counts, strict=True)}
        stored_runs = Runs.open(execution.folder)
        rows = [
            row
            for row in stored_runs.evaluated_rows()
            if row["repetition"] == latest[row["tracker"]]
        ]
        runs = collect_runs(stored_runs.read(rows), list(latest), with_tracker_values=True)
        page = _page(runs, progress)
        failures = [run.failure for sequence in runs.sequences for run in sequence.one_pass]
        return write_page(path, page), [failure for failure in failures if failure]


def _page(runs: PageRuns, progress: Progress) -> Page:
    """Return the page of the only sequence."""
    (sequence,) = with_frames(runs.sequences, progress, height=_MAX_HEIGHT)
    named = ", ".join(runs.trackers)
    repetition = max(player_run.repetition for player_run in sequence.runs)
    title = f"{named} on {sequence.name}" + f", repetition {repetition}" * bool(repetition)
    caption = (
        f"The player shows the boxes, masks, contours, particles, maps and numbers that {named} "
        f"returned on {sequence.name} in repetition {repetition}. Select the sequence to open the "
        "player; ? lists the keys."
    )
    section = PageSection("frames", "Frames", lists_sequences=True, caption=caption)
    page = Page(title, [section], runs.trackers, [sequence])
    address = {"tracker": runs.trackers[0], "repetition": str(repetition)}
    for name in [name for player_run in sequence.runs for name in player_run.maps][:1]:
        address["map"] = name
    return replace(page, start=player_link(sequence, None, **address))
