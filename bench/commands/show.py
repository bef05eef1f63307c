"""Show a sequence and what trackers say of it: film strip, video, or a page to step through."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO
from trackmark.bench.commands._options import (
    patience,
    progress_bar,
    split_list,
    trace_option,
    truth_option,
)
from trackmark.bench.commands._terminal import complain

if TYPE_CHECKING:
    from trackmark.bench.evaluation.run_record import Trace


@click.command("show")
@click.argument("sequence")
@truth_option
@click.option(
    "--results",
    type=click.Path(path_type=Path),
    help="Draw what the runs in this folder said, too.",
)
@click.option(
    "--live",
    metavar="TRACKER[,TRACKER]…",
    help="Run them on SEQUENCE, and write a page that steps through what they see.",
)
@trace_option
@click.option(
    "--repetition",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Which one is drawn, or run, of trackers that draw random numbers.",
)
@click.option(
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="A .png is a film strip, an .mp4 a video (H.264).  [--live: live.html]",
)
@click.option(
    "--frames",
    "count",
    type=click.IntRange(1),
    default=10,
    show_default=True,
    help="Frames on a film strip.",
)
@click.option("--first", type=click.IntRange(0), default=0, help="First frame shown.")
@click.option("--last", type=click.IntRange(0), help="Last frame shown.")
def command(
    sequence: str,
    truth: Path | None,
    results: Path | None,
    live: str | None,
    trace: "Trace",
    repetition: int,
    output: Path | None,
    count: int,
    first: int,
    last: int | None,
) -> int:
    """Show SEQUENCE (a name or a path), its truth, and with --results what trackers said.

    With --live trackers are run on it, and a page in one file steps through boxes, masks,
    contours, particles, maps of what pixels weigh, and the trackers' own numbers. Exit status 1
    where one failed.
    """
    from trackmark import datasets
    from trackmark.reports.overlay import TRUTH

    if live is not None:
        where = output or Path("live.html")
        return _live(sequence, truth, split_list(live), where, repetition)
    if output is None:
        raise click.UsageError("Give --output, a .png or an .mp4 file, or --live.")
    if output.suffix not in (".png", ".mp4"):
        raise click.BadParameter(f"{output} is neither .png nor .mp4.", param_hint="--output")
    if results is None and trace != "online":
        raise click.BadParameter(
            "it chooses among the boxes of --results; give both.", param_hint="--trace"
        )
    with patience(f"Opening {sequence}"):
        opened = datasets.load(sequence, truth=truth)
    source = Path(sequence).resolve()
    if output.exists() and source in (output.resolve(), *output.resolve().parents):
        raise click.BadParameter(
            f"{output} is part of the sequence and would be overwritten.", param_hint="--output"
        )
    end = len(opened) - 1 if last is None else last
    if not first <= end < len(opened):
        raise click.BadParameter(
            f"frames {first} to {end} are not among 0 to {len(opened) - 1}.", param_hint="--last"
        )
    boxes: dict[str, Any] = {}
    outlines: dict[str, Any] = {}
    if opened.present.any():
        boxes[TRUTH] = opened.boxes
    if results is not None:
        found, outlines = _said(results, opened, repetition, trace)
        boxes |= found
    _draw(opened, range(first, end + 1), boxes, outlines, output, count)
    click.echo(str(output))
    return 0


def _live(
    sequence: str, truth: Path | None, trackers: list[str], output: Path, repetition: int
) -> int:
    from trackmark.bench.experiments.experiment import SequenceSource
    from trackmark.bench.pages.live_page import write_live_page

    context = click.get_current_context()
    given = click.core.ParameterSource.COMMANDLINE
    for name in ("results", "trace", "count", "first", "last"):
        if context.get_parameter_source(name) == given:
            option = "--frames" if name == "count" else f"--{name}"
            raise click.UsageError(f"{option} and --live exclude each other.")
    if output.suffix != ".html":
        raise click.BadParameter(f"{output} is no .html file.", param_hint="--output")
    if not trackers:
        raise click.BadParameter("it names no tracker.", param_hint="--live")
    source = SequenceSource(sequence, truth)
    with progress_bar(None, "frame") as progress:
        paths, failures = write_live_page(trackers, source, output, progress, repetition)
    for failure in failures:
        complain(failure.partition("\n")[0])
    click.echo(str(paths[0]))
    return EXIT_ANSWER_IS_NO if failures else 0


def _said(
    results: Path, sequence: Any, repetition: int, trace: "Trace"
) -> tuple[dict[str, Any], dict[str, Any]]:
    import numpy as np

    from trackmark.bench.reporting.film_strips import boxes_on
    from trackmark.bench.store.files import ResultsError
    from trackmark.reports.overlay import TRUTH

    found, outlines = boxes_on(results, sequence.name, repetition, trace)
    if not found:
        raise ResultsError(f"{results}: there are no runs on {sequence.name}.")
    known = sequence.present.any()
    if len(found[TRUTH]) != len(sequence) or (
        known and not np.array_equal(found[TRUTH], sequence.boxes, equal_nan=True)
    ):
        raise ResultsError(
            f"{results}: the runs on {sequence.name} were made on another version of it. "
            "Run them again on the sequence as it is."
        )
    return found, outlines


def _draw(
    sequence: Any,
    shown: range,
    boxes: dict[str, Any],
    outlines: dict[str, Any],
    output: Path,
    count: int,
) -> None:
    from trackmark.bench.reporting.outlines import outlines_on
    from trackmark.reports.film_strip import evenly_spaced, film_strip, write_film_strip

    if output.suffix == ".png":
        numbers = evenly_spaced(shown.start, shown.stop - 1, count)
        strip = film_strip(
            sequence.__getitem__,
            numbers,
            boxes,
            sequence.name,
            lines_of=outlines_on(sequence, outlines),
        )
        write_film_strip(output, strip)
        return
    from trackmark.reports.video import write_video

    with progress_bar(len(shown), "frame") as progress:

        def images() -> Any:
            for done, number in enumerate(shown):
                progress(done)
                yield number, sequence[number]

        write_video(output, images(), boxes, sequence.fps, outlines_on(sequence, outlines))
