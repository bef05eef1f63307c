"""Draw a sequence with boxes of trackers: film strip, video or page."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._options import (
    OUTPUT_FILE,
    PATH,
    SPECIFICATION,
    Command,
    IntegerRange,
    input_option,
    layout_option,
    output_option,
    split_list,
    trajectory_option,
    truth_option,
)
from trackmark.bench.commands._progress import (
    open_runs,
    print_message,
    progress_bar,
    report_slow_work,
)
from trackmark.bench.commands._terminal import print_error

if TYPE_CHECKING:
    from trackmark.bench.evaluation.run_record import Trajectory
    from trackmark.datasets import Sequence

_OPTIONS_OF_STRIPS = ("results", "trajectory", "n_frames", "first_frame", "last_frame")


@click.command("show", cls=Command)
@click.argument("sequence", type=SPECIFICATION)
@truth_option
@layout_option
@input_option("--results", type=PATH, help="Also draw boxes of stored runs in this results folder.")
@input_option(
    "--live",
    metavar="TRACKER[,TRACKER]…",
    type=SPECIFICATION,
    help="Run these trackers and write a page with their internal data.",
)
@trajectory_option
@input_option(
    "--repetition",
    type=IntegerRange(0),
    default=0,
    help="Index of the repetition that is drawn or run.",
)
@output_option(
    "--output",
    type=OUTPUT_FILE,
    help="Film strip (.png), video (.mp4, H.264) or, with --live, page.  [--live: live.html]",
)
@output_option(
    "--frames",
    "n_frames",
    type=IntegerRange(1),
    default=10,
    help="Number of frames of a film strip.",
)
@output_option("--first-frame", type=IntegerRange(0), default=0, help="First frame to draw.")
@output_option(
    "--last-frame",
    type=IntegerRange(0),
    help="Last frame to draw.  [default: last of the sequence]",
)
def command(
    sequence: str,
    truth: Path | None,
    results: Path | None,
    live: str | None,
    trajectory: "Trajectory",
    repetition: int,
    output: Path | None,
    n_frames: int,
    first_frame: int,
    last_frame: int | None,
) -> int:
    """Draw a sequence with boxes of trackers: film strip, video or page.

    SEQUENCE is a name or a path. The film strip or video shows its ground truth and boxes of stored
    runs. With --live, trackers are run on it; a page in one file then shows boxes, masks, contours,
    particles, weight maps and the values that the trackers report.

    For example:
      trackmark show samples/face --results results/windows --output face.mp4
      trackmark show samples/face --live camshift,multipart

    Exit codes: 0 success; 1 a tracker of --live failed; 2 invalid usage or input; 130 interrupted.
    """
    from trackmark import datasets
    from trackmark.reports.overlay import TRUTH

    if live is not None:
        page = output or Path("live.html")
        return _live(split_list(live), sequence, truth, repetition, page)
    if output is None:
        raise click.UsageError("The output is missing. Use --output FILE (.png or .mp4) or --live.")
    if output.suffix not in (".png", ".mp4"):
        raise click.BadParameter(f"{output} is neither .png nor .mp4.", param_hint="--output")
    if results is None and trajectory != "online":
        raise click.BadParameter(
            "requires --results, because it selects boxes of stored runs.",
            param_hint="--trajectory",
        )
    with report_slow_work(f"Opening {sequence}"):
        opened = datasets.load(sequence, truth=truth)
    source = Path(sequence).resolve()
    if output.exists() and source in (output.resolve(), *output.resolve().parents):
        raise click.BadParameter(
            f"{output} is part of the sequence and would be overwritten.", param_hint="--output"
        )
    last = len(opened) - 1 if last_frame is None else last_frame
    if not first_frame <= last < len(opened):
        raise click.BadParameter(
            f"frames {first_frame} to {last} are not among 0 to {len(opened) - 1}.",
            param_hint="--last-frame",
        )
    boxes: dict[str, Any] = {TRUTH: opened.boxes} if opened.present.any() else {}
    outlines: dict[str, Any] = {}
    if results is not None:
        tracker_boxes, outlines = _boxes_of_runs(results, opened, repetition, trajectory)
        boxes |= tracker_boxes
    _draw(opened, range(first_frame, last + 1), boxes, outlines, output, n_frames)
    click.echo(str(output))
    return 0


def _live(
    trackers: list[str], sequence: str, truth: Path | None, repetition: int, page: Path
) -> int:
    """Run trackers, write the page, and return the exit status."""
    from trackmark.bench.experiments.experiment import SequenceSpec
    from trackmark.bench.pages.live_page import write_live_page

    context = click.get_current_context()
    for parameter in context.command.params:
        source = context.get_parameter_source(str(parameter.name))
        is_of_strip = parameter.name in _OPTIONS_OF_STRIPS
        if is_of_strip and source == click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{parameter.opts[0]} and --live exclude each other.")
    if page.suffix != ".html":
        raise click.BadParameter(f"{page} is not an .html file.", param_hint="--output")
    if not trackers:
        raise click.BadParameter("the list is empty. Name at least one.", param_hint="--live")
    spec = SequenceSpec(sequence, truth)
    with progress_bar("Running trackers", None, "frame") as progress:
        paths, failures = write_live_page(trackers, spec, page, progress, repetition)
    for failure in failures:
        print_error(failure.partition("\n")[0])
    click.echo(str(paths[0]))
    return EXIT_NEGATIVE if failures else 0


def _boxes_of_runs(
    folder: Path, sequence: "Sequence", repetition: int, trajectory: "Trajectory"
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return boxes and outlines of stored runs on a sequence, by tracker."""
    import numpy as np

    from trackmark.bench.analysis.film_strips import boxes_on
    from trackmark.bench.store.database import ResultsError, experiment_folders
    from trackmark.reports.overlay import TRUTH

    experiments = [open_runs(path) for path in experiment_folders(folder)]
    boxes, outlines = boxes_on(experiments, sequence.name, repetition, trajectory)
    for row in [row for runs in experiments for row in runs.rows]:
        if row["sequence"] == sequence.name and row["status"] == "stale":
            print_message(
                f"{row['tracker']}, repetition {row['repetition']}: not drawn, because the run is "
                "of another version of the tracker or the sequence. Run it again."
            )
    if not boxes:
        raise ResultsError(
            f"{folder}: no runs on {sequence.name} found. Run a tracker on it first."
        )
    if len(boxes[TRUTH]) != len(sequence) or (
        sequence.present.any() and not np.array_equal(boxes[TRUTH], sequence.boxes, equal_nan=True)
    ):
        raise ResultsError(
            f"{folder}: the runs on {sequence.name} used another version of the sequence. "
            "Repeat them on the current one."
        )
    return boxes, outlines


def _draw(
    sequence: "Sequence",
    frames: range,
    boxes: dict[str, Any],
    outlines: dict[str, Any],
    output: Path,
    n_shown: int,
) -> None:
    """Write a film strip of `n_shown` frames, or a video of all frames."""
    from trackmark.bench.analysis.outlines import outlines_on
    from trackmark.bench.output_files import write_file
    from trackmark.reports.overlay import evenly_spaced, film_strip, save_png
    from trackmark.reports.video import save_video

    lines = outlines_on(sequence, outlines)
    if output.suffix == ".png":
        shown_frames = evenly_spaced(frames.start, frames.stop - 1, n_shown)
        image = sequence.__getitem__
        strip = film_strip(image, shown_frames, boxes, sequence.name, lines_of=lines)
        write_file(output, lambda file: save_png(file, strip))
        return
    with progress_bar("Drawing frames", len(frames), "frame") as progress:

        def images() -> Any:
            for done, frame in enumerate(frames, 1):
                yield frame, sequence[frame]
                progress(done)

        write_file(output, lambda file: save_video(file, images(), boxes, sequence.fps, lines))
