"""Show a sequence, with boxes where there are some: film strip (PNG) or video (MP4)."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bench.commands._options import patience, progress_bar, trace_option, truth_option

if TYPE_CHECKING:
    from bench.evaluation.record import Trace

__all__ = ["command"]


@click.command("show")
@click.argument("sequence")
@truth_option
@click.option(
    "--results",
    type=click.Path(path_type=Path),
    help="Draw the boxes of the runs in this folder too.",
)
@trace_option
@click.option("--repetition", type=click.IntRange(0), default=0, show_default=True)
@click.option(
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="A .png is a film strip, an .mp4 a video (H.264).",
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
    trace: "Trace",
    repetition: int,
    output: Path,
    count: int,
    first: int,
    last: int | None,
) -> None:
    """Show SEQUENCE (a name or a path), its truth, and with --results what trackers said."""
    import datasets
    from bench.store.files import ResultsError
    from reports.overlay import TRUTH

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
    if opened.present.any():
        boxes[TRUTH] = opened.boxes
    if results is not None:
        boxes |= _boxes(results, opened, repetition, trace)
    try:
        _draw(opened, range(first, end + 1), boxes, output, count)
    except OSError as error:
        raise ResultsError(str(error.strerror or error)) from error
    click.echo(str(output))


def _boxes(results: Path, sequence: Any, repetition: int, trace: "Trace") -> dict[str, Any]:
    import numpy as np

    from bench.reporting.pictures import boxes_of
    from bench.store.files import ResultsError
    from reports.overlay import TRUTH

    found = boxes_of(results, sequence.name, repetition, trace)
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
    return found


def _draw(sequence: Any, shown: range, boxes: dict[str, Any], output: Path, count: int) -> None:
    from reports.film_strip import evenly_spaced, film_strip, write_film_strip

    if output.suffix == ".png":
        numbers = evenly_spaced(shown.start, shown.stop - 1, count)
        write_film_strip(output, film_strip(sequence.__getitem__, numbers, boxes, sequence.name))
        return
    from reports.video import write_video

    with progress_bar(len(shown), "frame") as progress:

        def images() -> Any:
            for done, number in enumerate(shown):
                progress(done)
                yield number, sequence[number]

        write_video(output, images(), boxes, sequence.fps)
