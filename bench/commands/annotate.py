"""Write the truth of a video from boxes marked on some of its frames."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands._options import parse_box, patience
from trackmark.bench.experiments.experiment import ExperimentError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from trackmark.bench.commands._box_picker import Boxes
    from trackmark.datasets import Sequence
    from trackmark.datasets.truth_file import Truth

STRIP_FRAMES = 24


@click.command("annotate")
@click.argument("video", type=click.Path(path_type=Path, exists=True))
@click.option(
    "--box",
    "boxes",
    multiple=True,
    metavar="FRAME:X,Y,WIDTH,HEIGHT",
    help="A box on a key frame, in pixels; frames count from 0. Give it for every key frame.",
)
@click.option(
    "--keys",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="CSV frame,x,y,width,height with more key frames.",
)
@click.option(
    "--absent",
    multiple=True,
    metavar="FIRST-LAST",
    help="Frames, both included, in which nothing of the target is seen.",
)
@click.option(
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Truth file.  [default: beside the video, its name with .csv, where `run` finds it]",
)
@click.option(
    "--pick", is_flag=True, help="Draw boxes on a page in the browser, which this machine serves."
)
@click.option("--note", help="A line for the truth file's head: who marked what, how.")
@click.option("--force", is_flag=True, help="Replace a truth file that is there.")
def command(
    video: Path,
    boxes: tuple[str, ...],
    keys: Path | None,
    absent: tuple[str, ...],
    output: Path | None,
    pick: bool,
    note: str | None,
    force: bool,
) -> None:
    """Write the truth of VIDEO (a video file or a folder of images).

    Boxes between key frames are interpolated linearly, and marked so in the file. Frames
    before the first key frame and after the last are without target. A check strip is drawn
    beside the truth file: look at it, mark more frames where a box is off, and repeat.

    Example: trackmark annotate cup.mp4 --box 0:310,120,64,80 --box 12:298,131,64,80

    With --pick boxes are drawn in a browser. It is opened where there is a display; elsewhere go
    to the address that is printed, from another machine through a tunnel (ssh -L).
    """
    from trackmark import datasets
    from trackmark.datasets import truth_file
    from trackmark.reports.files import write_file
    from trackmark.reports.film_strip import write_film_strip

    marked = _marked(boxes, keys)
    with patience(f"Opening {video}"):
        loaded = datasets.load(video)
    # A truth file that is there already must not hide the images that follow its last row.
    sequence = datasets.Sequence(loaded.name, loaded.frames, fingerprint="")
    target = output or (video / "truth.csv" if video.is_dir() else video.with_suffix(".csv"))
    _check_target(target, force=force)
    gone = [_stretch(text) for text in absent]
    if pick:
        from trackmark.bench.commands._box_picker import pick_boxes

        marked = pick_boxes(sequence, marked, lambda boxes: _truth(sequence, boxes, gone))
    truth = _truth(sequence, marked, gone)
    n = len(truth.boxes)
    comments = [
        f"Truth of {video.name}, {n} frames. Boxes marked by hand on {len(marked)} key frames,",
        "interpolated linearly between them; the column source tells which is which.",
        *([note] if note else []),
    ]
    strip = _strip_path(video, target)
    drawn = _check_strip(sequence, truth, f"{strip.stem}: look whether every box fits")
    write_file(target, lambda file: truth_file.write(file, truth, comments))
    write_film_strip(strip, drawn)
    sources = list(truth.sources or ())
    click.echo(
        f"{target}: {len(marked)} boxes marked, {sources.count('interpolated')} interpolated, "
        f"{sources.count('')} frames without target."
    )
    click.echo(f"{strip}: look whether the boxes fit; --force replaces the file.")


def _marked(texts: tuple[str, ...], keys: Path | None) -> "Boxes":
    """Boxes of --box and, of other frames, those in the file of --keys."""
    from trackmark.datasets import truth_file

    marked = dict(parse_box(text) for text in texts)
    rows = [] if keys is None else truth_file.read(keys).boxes.tolist()
    # A row of NaN is a frame that the file says nothing about.
    return {frame: box for frame, box in enumerate(rows) if box[0] == box[0]} | marked


def _check_target(target: Path, *, force: bool) -> None:
    """Refuse a place where the truth can't go, before anything is drawn."""
    from trackmark.datasets.decoding import check_name

    check_name(target.absolute())
    if target.suffix != ".csv":
        raise ExperimentError(f"{target}: a truth file's name ends in .csv.")
    if target.exists() and not force:
        raise ExperimentError(f"{target} is there already; --force replaces it.")


def _truth(sequence: "Sequence", marked: "Boxes", absent: list[tuple[int, int]]) -> "Truth":
    """Truth of all frames, from what was marked of them."""
    from trackmark.datasets.annotation import interpolate

    n = len(sequence)
    if len(marked) == 1 and n > 1:
        raise ExperimentError(
            "one key frame says nothing of the others: mark the target in at least two frames."
        )
    height, width = sequence[0].shape[:2]
    return interpolate(marked, n, absent, (width, height))


def _check_strip(sequence: "Sequence", truth: "Truth", title: str) -> "NDArray[np.uint8]":
    """Draw frames with their boxes: the key frames, or every so often where they are few."""
    import numpy as np

    from trackmark.reports.film_strip import evenly_spaced, film_strip

    sources = np.array(truth.sources)
    boxes = {
        source: np.where((sources == source)[:, None], truth.boxes, np.nan)
        for source in ("marked", "interpolated")
    }
    with_box = np.flatnonzero(sources != "")
    numbers = [
        int(with_box[position]) for position in evenly_spaced(0, len(with_box) - 1, STRIP_FRAMES)
    ]
    return film_strip(sequence.__getitem__, numbers, boxes, title, 6, ruler=True)


def _strip_path(video: Path, target: Path) -> Path:
    """Beside the truth file, but never among the images, where it would be one of them."""
    if target.resolve().parent == video.resolve():
        return video.resolve().with_name(f"{video.resolve().name}-check.png")
    return target.with_name(f"{target.stem}-check.png")


def _stretch(text: str) -> tuple[int, int]:
    first, dash, last = text.partition("-")
    try:
        return int(first), int(last if dash else first)
    except ValueError:
        raise click.BadParameter(f"{text!r} is not FIRST-LAST.", param_hint="--absent") from None
