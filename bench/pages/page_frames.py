"""The frames behind a page's numbers: read where sequences are still there and the same."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.pages.player_layers import mask_shapes
from trackmark.bench.reporting.stored_runs import open_sequence
from trackmark.reports.page.film import film

Watch = Callable[[int, int | None], None]
"""Told how many frames are done, of how many."""

Keep = Callable[[str, Sequence[bytes]], object]
"""Given the name and the frames of a chunk that stands beside the page."""

THUMBNAIL = 160
"""Height of the frames that a page holds [pixels]."""

_FULL_QUALITY = 85  # of WebP

_WORTH_WORKERS = 1500  # frames from which on processes, which take seconds to start, are sooner
_OPENING = 60  # as many frames take the time in which a synthetic sequence is opened, and its first


class Filmed(NamedTuple):
    """Frames of a sequence: `thumbnails` in chunks, sizes of `full` ones, `why` some are not.

    `shapes`: outlines of true masks by frame, which the truth beside stored runs may lack.
    """

    thumbnails: Sequence[Sequence[bytes]] = ()
    full: Sequence[Sequence[int]] = ()
    why: str = ""
    shapes: Mapping[int, Mapping[str, Any]] = {}


def film_all(
    rows: Sequence[tuple[Mapping[str, Any], Sequence[int]]],
    watch: Watch,
    keep: Keep | None = None,
    height: int = THUMBNAIL,
) -> Iterator[Filmed]:
    """Frames of sequences in their order, by a row of a run of each and the frames' numbers.

    `keep`: given frames of their own size, too; it can be pickled. `height`: most of the others.
    """
    numbers = [frames for _, frames in rows]
    lengths = [*map(len, numbers)]
    told = [
        {key: row[key] for key in ("sequence", "source", "truth", "fingerprint")} for row, _ in rows
    ]
    given = told, count(), numbers, [keep] * len(rows), [height] * len(rows)
    if sum(lengths) + _OPENING * len(rows) < _WORTH_WORKERS or len(rows) < 2:
        done = 0

        def seen() -> None:
            nonlocal done
            done += 1
            watch(done, sum(lengths))

        for one in zip(*given, strict=False):
            yield _filmed(*one, seen)
        return
    from loky import ProcessPoolExecutor

    with ProcessPoolExecutor(min(os.cpu_count() or 1, len(rows))) as workers:
        for number, found in enumerate(workers.map(_filmed, *given), 1):
            watch(sum(lengths[:number]), sum(lengths))
            yield found


def _filmed(
    row: Mapping[str, Any],
    number: int,
    frames: Sequence[int],
    keep: Keep | None,
    height: int,
    seen: Callable[[], None] = lambda: None,
) -> Filmed:
    if not frames:
        return Filmed()
    sequence = open_sequence(row)
    if isinstance(sequence, str):
        return Filmed(why=f"No frames: {sequence}")
    sizes = []
    try:
        images = (sequence[frame] for frame in frames)
        thumbnails = list(film(_counted(images, seen), height))
        shapes = mask_shapes((frame, sequence.mask(frame)) for frame in frames)
        if keep is not None:
            images = (sequence[frame] for frame in frames)
            for chunk, encoded in enumerate(film(images, quality=_FULL_QUALITY)):
                keep(f"full-{number}-{chunk}", encoded)
                sizes.append([len(frame) for frame in encoded])
    except datasets.SequenceError as error:
        return Filmed(why=f"No frames: {error}")
    return Filmed(thumbnails, sizes, shapes=shapes)


def _counted(
    images: Iterable[NDArray[np.uint8]], seen: Callable[[], None]
) -> Iterator[NDArray[np.uint8]]:
    for image in images:
        yield image
        seen()
