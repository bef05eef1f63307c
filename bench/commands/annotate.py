"""Write the ground truth of a video from boxes on key frames."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands._options import (
    EXISTING_FILE,
    Command,
    argument,
    option,
    output_option,
    with_options,
)
from trackmark.bench.commands._progress import patience
from trackmark.bench.experiments.experiment import ExperimentError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from trackmark.bench.commands._box_picker import Boxes
    from trackmark.datasets import Sequence
    from trackmark.datasets.truth_file import GroundTruth

STRIP_FRAMES = 24


@dataclass(frozen=True, kw_only=True)
class AnnotateOptions:
    """Options of the command."""

    video: Path = argument(type=click.Path(path_type=Path, exists=True))
    boxes: tuple[str, ...] = option(
        "Box on a key frame [pixels]; frames count from 0. Repeatable.",
        "--box",
        metavar="FRAME:X,Y,WIDTH,HEIGHT",
    )
    keys: Path | None = option(
        "More key frames: CSV with frame,x,y,width,height.", type=EXISTING_FILE
    )
    absent: tuple[str, ...] = option(
        "Frames without visible target, both ends included. Repeatable.", metavar="FIRST-LAST"
    )
    output: Path | None = output_option(
        "Ground-truth file.  [default: the name of the video with .csv, next to the video]",
        type=click.Path(path_type=Path, dir_okay=False),
    )
    pick: bool = option("Draw boxes on a page in the browser.")
    note: str | None = output_option("Comment for the head of the file: who marked what, and how.")
    force: bool = output_option("Replace an existing file.")


@click.command("annotate", cls=Command)
@with_options(AnnotateOptions)
def command(options: AnnotateOptions) -> None:
    """Write the ground truth of a video from boxes on key frames.

    VIDEO is a video file or a folder of images. Boxes between key frames are interpolated linearly;
    the file marks them as interpolated. Frames before the first and after the last key frame have
    no target. A film strip for checking the boxes is drawn next to the file. If a box does not fit,
    add key frames and repeat the command.

    With --pick, draw the boxes in a browser, which opens if there is a display. Otherwise open the
    printed address, from another machine through a tunnel (ssh -L).

    For example:
      trackmark annotate cup.mp4 --box 0:310,120,64,80 --box 12:298,131,64,80
      trackmark annotate cup.mp4 --pick

    Exit codes: 0 success; 2 invalid usage or input; 130 interrupted.
    """
    from trackmark import datasets
    from trackmark.datasets import truth_file
    from trackmark.reports.files import write_file
    from trackmark.reports.overlay import write_film_strip

    video = options.video
    marked = _marked(options.boxes, options.keys)
    with patience(f"Opening {video}"):
        loaded = datasets.load(video)
    # An existing ground-truth file would hide the images after its last row.
    sequence = datasets.Sequence(loaded.name, loaded.frames, fingerprint="")
    default = video / "truth.csv" if video.is_dir() else video.with_suffix(".csv")
    target = options.output or default
    _check_target(target, force=options.force)
    ranges = [_frame_range(text) for text in options.absent]
    if options.pick:
        from trackmark.bench.commands._box_picker import pick_boxes

        marked = pick_boxes(sequence, marked, lambda boxes: _truth(sequence, boxes, ranges))
    truth = _truth(sequence, marked, ranges)
    comments = [
        f"Truth of {video.name}, {len(truth.boxes)} frames. Boxes marked by hand on {len(marked)} "
        "key frames,",
        "interpolated linearly between them; the column source tells which is which.",
        *([options.note] if options.note else []),
    ]
    strip = target.with_name(f"{target.stem}-check.png")
    if target.resolve().parent == video.resolve():  # there, a picture would be read as a frame
        strip = video.resolve().with_name(f"{video.resolve().name}-check.png")
    picture = _check_strip(sequence, truth, f"{strip.stem}: check that every box fits")
    write_file(target, lambda file: truth_file.write(file, truth, comments))
    write_film_strip(strip, picture)
    sources = list(truth.sources or ())
    click.echo(
        f"{target}: {len(marked)} boxes marked, {sources.count('interpolated')} interpolated, "
        f"{sources.count('')} frames without target.\n"
        f"{strip}: check that the boxes fit; --force replaces the file."
    )


def _marked(texts: tuple[str, ...], keys: Path | None) -> "Boxes":
    """Return the boxes of key frames; a box of --box replaces that frame's box of --keys."""
    from trackmark.datasets import truth_file

    marked = dict(_parse_box(text) for text in texts)
    # Frames that the file omits have NaN boxes.
    rows = [] if keys is None else truth_file.read(keys).boxes.tolist()
    return {frame: box for frame, box in enumerate(rows) if box[0] == box[0]} | marked


def _parse_box(text: str) -> tuple[int, list[float]]:
    """Return frame and box of `FRAME:X,Y,WIDTH,HEIGHT`."""
    frame, _, numbers = text.partition(":")
    try:
        box = [float(number) for number in numbers.split(",")]
        if len(box) == 4:
            return int(frame), box
    except ValueError:
        pass
    raise click.BadParameter(
        f"{text!r} is not FRAME:X,Y,WIDTH,HEIGHT. Use, for example, 0:310,120,64,80.",
        param_hint="--box",
    )


def _frame_range(text: str) -> tuple[int, int]:
    first, dash, last = text.partition("-")
    try:
        return int(first), int(last if dash else first)
    except ValueError:
        raise click.BadParameter(
            f"{text!r} is not FIRST-LAST. Use, for example, 10-25.", param_hint="--absent"
        ) from None


def _check_target(target: Path, *, force: bool) -> None:
    """Raise `ExperimentError` if the file cannot be written, before anything is drawn."""
    from trackmark.datasets.decoding import check_name

    check_name(target.absolute())
    if target.suffix != ".csv":
        raise ExperimentError(f"{target}: not a .csv file. Give a name that ends in .csv.")
    if target.exists() and not force:
        raise ExperimentError(f"{target}: the file exists. Replace it with --force.")


def _truth(sequence: "Sequence", marked: "Boxes", absent: list[tuple[int, int]]) -> "GroundTruth":
    """Return the ground truth of all frames."""
    from trackmark.datasets.annotation import interpolate

    n = len(sequence)
    if len(marked) == 1 and n > 1:
        raise ExperimentError("1 key frame is given. Mark the target in two frames or more.")
    height, width = sequence[0].shape[:2]
    return interpolate(marked, n, absent, (width, height))


def _check_strip(sequence: "Sequence", truth: "GroundTruth", title: str) -> "NDArray[np.uint8]":
    """Draw evenly spaced frames with their boxes."""
    import numpy as np

    from trackmark.reports.overlay import evenly_spaced, film_strip

    sources = np.array(truth.sources)
    boxes = {
        source: np.where((sources == source)[:, None], truth.boxes, np.nan)
        for source in ("marked", "interpolated")
    }
    with_box = np.flatnonzero(sources != "")
    numbers = with_box[evenly_spaced(0, len(with_box) - 1, STRIP_FRAMES)].tolist()
    return film_strip(sequence.__getitem__, numbers, boxes, title, 6, ruler=True)
