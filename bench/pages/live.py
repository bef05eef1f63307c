"""Trackers watched frame by frame: run once on a sequence, with all they tell, onto a page."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from bench.execution.run import Execution
from bench.experiments.experiment import Experiment, SequenceSource
from bench.pages.filming import Watch
from bench.pages.takes import Reading, read_takes, scenes
from datasets import SequenceError
from reports.page.content import Page, Section
from reports.page.page import write_page

__all__ = ["write_live_page"]

_HEIGHT = 480  # pixels, at most, of frames: there is a single sequence on the page


def write_live_page(
    trackers: Sequence[str],
    source: SequenceSource,
    path: Path,
    watch: Watch,
) -> tuple[list[Path], list[str]]:
    """Run trackers on a sequence in supervised processes, and write a page that steps through it.

    It shows boxes, masks, contours, particles, maps and the trackers' own numbers. `watch` is
    told how many frames were shown to trackers, and then read. Nothing of the runs is kept but the
    page. Gives its files, and why runs failed, which shows as
    far as they got.

    Raises `TrackerError`, `SequenceError`, `ExperimentError` for what can't be run, and `OSError`
    where the page can't be written.
    """
    with tempfile.TemporaryDirectory(prefix="trackmark-live-") as folder:
        experiment = Experiment("live", tuple(trackers), (source,), arrays=True)
        execution = Execution(experiment, Path(folder))
        for _ in execution.rows(lambda done: watch(done, execution.work)):
            pass
        if execution.errors:
            raise SequenceError("\n".join(execution.errors))
        labels = [chosen.label for chosen in execution.plan.trackers.values()]
        reading = read_takes(execution.folder, labels, detailed=True)
        page = _page(reading, watch)
        failures = [clip.failure for stage in reading.stages for clip in stage.clips]
        return write_page(path, page), [failure for failure in failures if failure]


def _page(reading: Reading, watch: Watch) -> Page:
    (scene,) = scenes(reading, "", watch, height=_HEIGHT)
    named = ", ".join(reading.trackers)
    words = [
        f"{named} on {scene.name}, frame by frame: boxes, masks, contours, particles, maps and "
        "numbers, as far as the trackers tell them. Open it to step through; ? lists the keys."
    ]
    title = f"{named} on {scene.name}"
    sections = [Section("frames", "Frames", words, scenes=True)]
    page = Page(title, sections, reading.trackers, [scene])
    names = [name for take in scene.takes for name in take.maps][:1]
    asked = {"tracker": reading.trackers[0]} | ({"map": names[0]} if names else {})
    return Page(title, sections, reading.trackers, [scene], page.opening(scene, None, **asked))
