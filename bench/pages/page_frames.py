"""Frames of a page, read from sequences that have not changed since their runs."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from itertools import accumulate, count
from typing import Any, NamedTuple

from trackmark import datasets
from trackmark.bench.analysis.stored_runs import open_sequence
from trackmark.bench.pages.content import Film
from trackmark.bench.pages.player_frames import encode_film
from trackmark.bench.pages.player_layers import mask_shapes

Watch = Callable[[int, int | None], None]
"""Callback with the number of processed frames and the number of all frames."""

Keep = Callable[[str, Sequence[bytes]], object]
"""Callback with the name and the frames of a chunk that is stored next to the page."""

THUMBNAIL = 160
"""Height of the frames inside a page [px]."""

_FULL_QUALITY = 85  # quality of WebP, 0 to 100

# Minimum number of frames for which worker processes, which take seconds to start, save time.
_MIN_FRAMES_FOR_WORKERS = 1500
_OPENING_COST = 60  # time to open a synthetic sequence, in frames


class Filmed(NamedTuple):
    """Frames of a sequence, or the reason why there are none."""

    thumbnails: Film = ()
    full: Sequence[Sequence[int]] = ()  # sizes of full-size frames [bytes]
    why: str = ""
    shapes: Mapping[int, Mapping[str, Any]] = {}  # ground-truth masks, which may not be stored


def film_all(
    rows: Sequence[tuple[Mapping[str, Any], Sequence[int]]],
    watch: Watch,
    keep: Keep | None = None,
    height: int = THUMBNAIL,
) -> Iterator[Filmed]:
    """Yield the frames of sequences.

    `rows`: row of any run on each sequence, and its frame numbers. `keep`: receives full-size
    frames; it can be pickled. `height`: maximum height of the frames inside the page [px].
    """
    names = "sequence", "source", "truth", "fingerprint"
    sources = [{name: row[name] for name in names} for row, _ in rows]
    numbers = [frames for _, frames in rows]
    ends = [*accumulate(map(len, numbers))]
    film_one = partial(_film, keep=keep, height=height)
    if len(rows) < 2 or ends[-1] + _OPENING_COST * len(rows) < _MIN_FRAMES_FOR_WORKERS:
        films = map(film_one, count(), sources, numbers)
        workers: AbstractContextManager[object] = nullcontext()
    else:
        from loky import ProcessPoolExecutor

        workers = pool = ProcessPoolExecutor(min(os.cpu_count() or 1, len(rows)))
        films = pool.map(film_one, range(len(rows)), sources, numbers)
    with workers:
        for end, filmed in zip(ends, films, strict=False):
            watch(end, ends[-1])
            yield filmed


def _film(
    number: int, row: Mapping[str, Any], frames: Sequence[int], *, keep: Keep | None, height: int
) -> Filmed:
    """Read and encode the frames of a sequence."""
    if not frames:
        return Filmed()
    sequence = open_sequence(row)
    if isinstance(sequence, str):
        return Filmed(why=f"No frames: {sequence}")
    sizes = []
    try:
        thumbnails = list(encode_film((sequence[frame] for frame in frames), height))
        shapes = mask_shapes((frame, sequence.mask(frame)) for frame in frames)
        if keep is not None:
            images = (sequence[frame] for frame in frames)
            for chunk, encoded in enumerate(encode_film(images, quality=_FULL_QUALITY)):
                keep(f"full-{number}-{chunk}", encoded)
                sizes.append([len(frame) for frame in encoded])
    except datasets.SequenceError as error:
        return Filmed(why=f"No frames: {error}")
    return Filmed(thumbnails, sizes, shapes=shapes)
