"""Write the ground truth of a video from boxes on key frames."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands._options import (
    EXISTING_FILE,
    OUTPUT_FILE,
    Command,
    input_option,
    output_option,
)
from trackmark.bench.commands._output_files import check_outputs
from trackmark.bench.commands._progress import print_event, report_slow_work
from trackmark.bench.experiments.experiment import ExperimentError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from trackmark.bench.commands._drawing import Drawing
    from trackmark.datasets import Sequence
    from trackmark.datasets.truth_file import GroundTruth

STRIP_FRAMES = 24
OPENINGS = ("Truth of", "interpolated linearly between them")  # of the comments in the file


@click.command("annotate", cls=Command)
@click.argument("video", type=click.Path(path_type=Path, exists=True))
@input_option(
    "--box",
    "box_options",
    multiple=True,
    metavar="FRAME:X,Y,WIDTH,HEIGHT",
    help="Box on a key frame [pixels]; frames count from 0. Repeatable.",
)
@input_option(
    "--key-frames",
    type=EXISTING_FILE,
    help="More key frames: CSV with frame,x,y,width,height.",
)
@input_option(
    "--absent",
    multiple=True,
    metavar="FIRST-LAST",
    help="Frames without visible target, both ends included. Repeatable.",
)
@output_option(
    "--output",
    type=OUTPUT_FILE,
    help="Ground-truth file.  [default: the name of the video with .csv, next to the video]",
)
@input_option(
    "--draw",
    is_flag=True,
    help="Draw boxes in the browser, starting from those of an existing file.",
)
@output_option("--note", help="Comment for the head of the file: who marked what, and how.")
@output_option(
    "--force", is_flag=True, help="Replace an existing file; --draw does not load its boxes."
)
def command(
    video: Path,
    box_options: tuple[str, ...],
    key_frames: Path | None,
    absent: tuple[str, ...],
    output: Path | None,
    draw: bool,
    note: str | None,
    force: bool,
) -> None:
    """Write the ground truth of a video from boxes on key frames.

    VIDEO is a video file or a folder of images. Boxes between key frames are interpolated linearly;
    the file marks them as interpolated. Frames before the first and after the last key frame have
    no target. A film strip for checking the boxes is drawn next to the file. If a box does not fit,
    add key frames and repeat the command.

    With --draw, draw, move and resize boxes in a browser, which opens if there is a display.
    Otherwise open the printed address, from another machine through a tunnel (ssh -L). Unsaved
    changes are kept next to the file, in FILE.draft; the next --draw loads them. Boxes that another
    tab or another program has changed meanwhile are not overwritten without your choice.

    For example:
      trackmark annotate cup.mp4 --box 0:310,120,64,80 --box 12:298,131,64,80
      trackmark annotate cup.mp4 --draw

    Exit codes: 0 success; 2 invalid usage or input; 130 interrupted.
    """
    from trackmark import datasets
    from trackmark.bench.commands._drawing import Drawing
    from trackmark.bench.output_files import write_file
    from trackmark.datasets import truth_file
    from trackmark.datasets.annotation import check_marks
    from trackmark.reports.overlay import save_png

    boxes = _marked(box_options, key_frames)
    drawing = Drawing(boxes=boxes, absent=[*map(_frame_range, absent)])
    with report_slow_work(f"Opening {video}"):
        loaded = datasets.load(video)
    # An existing ground-truth file would hide the images after its last row.
    sequence = datasets.Sequence(loaded.name, loaded.frames, fingerprint="", fps=loaded.fps)
    default = video / "truth.csv" if video.is_dir() else video.with_suffix(".csv")
    target = output or default
    height, width = sequence[0].shape[:2]

    def check(drawing: Drawing) -> None:
        check_marks(drawing.boxes, len(sequence), drawing.absent, (width, height))

    check(drawing)
    if not draw:
        remedy = " Use --draw, or --box for each of them."
        truth = _truth(drawing, len(sequence), (width, height), remedy)
    _check_target(target, replace=force or draw)
    check_outputs({"--output": target}, [] if key_frames is None else [key_frames])
    notes = [note] if note else []

    def save(drawing: Drawing) -> None:
        truth = _truth(drawing, len(sequence), (width, height))
        comments = [
            f"{OPENINGS[0]} {video.name}, {len(sequence)} frames. Boxes marked by hand on "
            f"{len(drawing.boxes)} key frames,",
            f"{OPENINGS[1]}; the column source tells which is which.",
            *notes,
        ]
        write_file(target, lambda file: truth_file.write(file, truth, comments))

    if draw:
        from trackmark.bench.commands._box_picker import BoxPicker
        from trackmark.bench.commands._drawing import DrawingFiles

        identity = f"{video.name}, {len(sequence)} frames of {width}x{height} px"
        files = DrawingFiles(
            target, identity, check=check, read=lambda: _read_drawing(target), write=save
        )
        message = files.load(drawing, replace=force)
        if message:
            print_event("note", message)
        if target.exists() and not force:
            comments = re.findall("(?m)^# ?(.*)", truth_file.read_text(target))
            notes = notes or [line for line in comments if not line.startswith(OPENINGS)]
        with BoxPicker(sequence, files, message) as picker:
            drawing = picker.run()
        truth = _truth(drawing, len(sequence), (width, height))
    strip = target.with_name(f"{target.stem}-check.png")
    if target.resolve().parent == video.resolve():  # there, a picture would be read as a frame
        strip = video.resolve().with_name(f"{video.resolve().name}-check.png")
    picture = _check_strip(sequence, truth, f"{strip.stem}: check that every box fits")
    if not draw:
        _check_target(target, replace=force)  # another program can have written it
        save(drawing)
    write_file(strip, lambda file: save_png(file, picture))
    sources = list(truth.sources or ())
    click.echo(
        f"{target}: {len(drawing.boxes)} boxes marked, {sources.count('interpolated')} "
        f"interpolated, {sources.count('')} frames without target.\n"
        f"{strip}: check that the boxes fit; --force replaces the file, --draw changes it."
    )


def _marked(box_options: tuple[str, ...], key_frames: Path | None) -> dict[int, list[float]]:
    """Return the boxes of key frames; a box of --box replaces that frame's box of --key-frames."""
    from trackmark.datasets import truth_file

    marked: dict[int, list[float]] = {}
    for frame, box in map(_parse_box, box_options):
        if frame in marked:
            raise click.BadParameter(
                f"frame {frame} has two boxes. Give one box per frame.", param_hint="--box"
            )
        marked[frame] = box
    # Frames that the file omits have NaN boxes.
    rows = [] if key_frames is None else truth_file.read(key_frames).boxes.tolist()
    return {frame: box for frame, box in enumerate(rows) if box[0] == box[0]} | marked


def _read_drawing(file: Path) -> "Drawing":
    """Return key frames and frames without target of a ground-truth file."""
    import numpy as np

    from trackmark.bench.commands._drawing import Drawing
    from trackmark.datasets import truth_file

    truth = truth_file.read(file)
    if truth.visibility is not None:
        raise ExperimentError(
            f"{file}: --draw does not keep the column visibility. Write another file: "
            f"--key-frames {file} --output NEW.csv."
        )
    rows = truth.boxes.tolist()
    sources = truth.sources or [""] * len(rows)
    boxes = {
        frame: box
        for frame, (box, source) in enumerate(zip(rows, sources, strict=True))
        if box[0] == box[0] and source != "interpolated"
    }
    between = range(min(boxes, default=0), max(boxes, default=0))
    is_absent = truth.annotated_frames & np.isnan(truth.boxes[:, 0])
    return Drawing(boxes=boxes, absent=[(i, i) for i in between if is_absent[i]])


def _parse_box(option: str) -> tuple[int, list[float]]:
    """Return frame and box of `FRAME:X,Y,WIDTH,HEIGHT`."""
    frame, _, values = option.partition(":")
    try:
        box = [float(value) for value in values.split(",")]
        if len(box) == 4:
            return int(frame), box
    except ValueError:
        pass
    raise click.BadParameter(
        f"{option!r} is not FRAME:X,Y,WIDTH,HEIGHT. Use, for example, 0:310,120,64,80.",
        param_hint="--box",
    )


def _frame_range(option: str) -> tuple[int, int]:
    first, dash, last = option.partition("-")
    try:
        return int(first), int(last if dash else first)
    except ValueError:
        raise click.BadParameter(
            f"{option!r} is not FIRST-LAST. Use, for example, 10-25.", param_hint="--absent"
        ) from None


def _check_target(target: Path, *, replace: bool) -> None:
    """Raise `ExperimentError` if the file cannot be written, before anything is drawn."""
    from trackmark.datasets.decoding import check_name

    check_name(target.absolute())
    if target.suffix != ".csv":
        raise ExperimentError(f"{target}: not a .csv file. Give a name that ends in .csv.")
    if target.exists() and not replace:
        raise ExperimentError(
            f"{target}: the file exists. Replace it with --force, or change its boxes with --draw."
        )


def _truth(
    drawing: "Drawing", n_frames: int, size: tuple[int, int], remedy: str = ""
) -> "GroundTruth":
    """Return the ground truth of all frames; `remedy` ends the message if boxes are missing."""
    from trackmark.datasets.annotation import interpolate

    n_boxes = len(drawing.boxes)
    if n_boxes < 2 <= n_frames:
        count = "1 key frame is" if n_boxes else "no key frames are"
        raise ExperimentError(f"{count} given. Mark the target in two frames or more.{remedy}")
    return interpolate(drawing.boxes, n_frames, drawing.absent, size)


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
    frames = with_box[evenly_spaced(0, len(with_box) - 1, STRIP_FRAMES)].tolist()
    return film_strip(sequence.__getitem__, frames, boxes, title, 6)
