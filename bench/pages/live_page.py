"""Page of trackers that are run once on a sequence, with all of their estimates."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from trackmark.bench.analysis.stored_runs import judged_runs
from trackmark.bench.execution.executor import Execution
from trackmark.bench.execution.plan import State
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.pages.content import Page, PageSection
from trackmark.bench.pages.page import write_page
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.player_runs import PageRuns, collect_runs, scenes
from trackmark.reports.temporary_paths import temporary_folder

_MAX_HEIGHT = 480  # height of frames [px]; large, as the page has one sequence only


def write_live_page(
    trackers: Sequence[str],
    source: SequenceSource,
    path: Path,
    watch: Watch,
    repetition: int = 0,
) -> tuple[list[Path], list[str]]:
    """Run trackers on a sequence in supervised processes and write a page with a player.

    The page shows boxes, masks, contours, particles, maps and the numbers of the trackers; failed
    runs end at their last frame. `watch` receives the number of frames that trackers have
    processed, then the number of frames that were read for the page. `repetition`: repetition of
    stochastic trackers, as in `run`. Returns the files of the page and the reasons of failed runs;
    the runs are not stored.

    Raises `TrackerError`, `SequenceError` or `ExperimentError` if something cannot be run, and
    `OSError` if the page cannot be written.
    """
    with temporary_folder() as folder:
        count = repetition + 1
        experiment = Experiment("live", tuple(trackers), (source,), count, arrays=True)
        execution = Execution(experiment, folder)
        plan = execution.plan
        last = plan.repetitions[plan.run_trackers] - 1
        plan.states[:, plan.run_repetitions < last] = State.DONE  # run only the last repetition
        specs = [*plan.trackers.values()]
        for _ in execution.rows(lambda done: watch(done, execution.units.work)):
            pass
        execution.raise_errors()
        counts = execution.plan.repetitions.tolist()  # larger if a tracker is stochastic after all
        latest = {spec.label: count - 1 for spec, count in zip(specs, counts, strict=True)}
        judged = judged_runs(execution.folder)
        last_runs = (
            entry for entry in judged if entry[0]["repetition"] == latest[entry[0]["tracker"]]
        )
        runs = collect_runs(last_runs, list(latest), with_numbers=True)
        page = _page(runs, watch)
        failures = [clip.take.failure for stage in runs.stages for clip in stage.clips]
        return write_page(path, page), [failure for failure in failures if failure]


def _page(runs: PageRuns, watch: Watch) -> Page:
    """Return the page of the only sequence."""
    (scene,) = scenes(runs, watch, height=_MAX_HEIGHT)
    named = ", ".join(runs.trackers)
    repetition = max(take.repetition for take in scene.takes)
    title = f"{named} on {scene.name}" + f", repetition {repetition}" * bool(repetition)
    caption = (
        f"The player shows the boxes, masks, contours, particles, maps and numbers that {named} "
        f"returned on {scene.name} in repetition {repetition}. Select the sequence to open the "
        "player; ? lists the keys."
    )
    section = PageSection("frames", "Frames", scenes=True, caption=caption)
    page = Page(title, [section], runs.trackers, [scene])
    address = {"tracker": runs.trackers[0], "repetition": str(repetition)}
    for name in [name for take in scene.takes for name in take.maps][:1]:
        address["map"] = name
    return replace(page, start=page.opening(scene, None, **address))
