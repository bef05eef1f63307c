"""Frames of a page, read from sequences that have not changed since their runs."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import accumulate, count
from typing import Any, NamedTuple

from trackmark import datasets
from trackmark.bench.execution.pool import map_in_workers
from trackmark.bench.pages.content import FrameChunks
from trackmark.bench.pages.player_frames import encode_images
from trackmark.bench.pages.player_layers import mask_shapes
from trackmark.bench.store.runs import reopen_sequence

Progress = Callable[[int, int | None], None]
"""Callback with the number of processed frames and the number of all frames."""

ChunkWriter = Callable[[str, Sequence[bytes]], object]
"""Callback with the name and the frames of a chunk that is stored next to the page."""

THUMBNAIL = 160
"""Height of the frames inside a page [px]."""

_FULL_QUALITY = 85  # quality of WebP, 0 to 100

# Minimum number of frames for which worker processes, which take seconds to start, save time.
_MIN_FRAMES_FOR_WORKERS = 1500
_OPENING_COST = 60  # time to open a synthetic sequence, in frames


class SequenceFrames(NamedTuple):
    """Frames of a sequence, or the reason why there are none."""

    thumbnails: FrameChunks = ()
    full: Sequence[int] = ()  # numbers of full-size frames by chunk
    reason: str = ""
    shapes: Mapping[int, Mapping[str, Any]] = {}  # ground-truth masks, which may not be stored


def encode_frames(
    rows: Sequence[tuple[Mapping[str, Any], Sequence[int]]],
    progress: Progress,
    write_chunk: ChunkWriter | None = None,
    height: int = THUMBNAIL,
) -> Iterator[SequenceFrames]:
    """Yield the frames of sequences, with a height [px] of at most `height` inside the page.

    Each of `rows` has the row of any run on a sequence and the indices of its frames. Full-size
    frames are passed to `write_chunk`, which worker processes call and which can thus be pickled.
    """
    names = "sequence", "source", "truth", "fingerprint"
    sources = [{name: row[name] for name in names} for row, _ in rows]
    frames_of = [frames for _, frames in rows]
    ends = [*accumulate(map(len, frames_of))]
    encode_one = partial(_encode_sequence, write_chunk=write_chunk, height=height)
    requests = [*zip(count(), sources, frames_of, strict=False)]
    frames_by_sequence: Iterable[SequenceFrames] = map(encode_one, requests)
    if len(rows) > 1 and ends[-1] + _OPENING_COST * len(rows) >= _MIN_FRAMES_FOR_WORKERS:
        n_workers = min(os.cpu_count() or 1, len(rows))
        frames_by_sequence = map_in_workers(encode_one, requests, n_workers)
    for end, sequence_frames in zip(ends, frames_by_sequence, strict=True):
        progress(end, ends[-1])
        yield sequence_frames


def _encode_sequence(
    request: tuple[int, Mapping[str, Any], Sequence[int]],
    *,
    write_chunk: ChunkWriter | None,
    height: int,
) -> SequenceFrames:
    """Read and encode the frames of a sequence: its index, its row and the frames."""
    index, row, frames = request
    if not frames:
        return SequenceFrames()
    full = []
    try:
        sequence = reopen_sequence(row)
        thumbnails = list(encode_images((sequence[frame] for frame in frames), height))
        shapes = mask_shapes((frame, sequence.mask(frame)) for frame in frames)
        if write_chunk is not None:
            images = (sequence[frame] for frame in frames)
            for chunk_index, encoded in enumerate(encode_images(images, quality=_FULL_QUALITY)):
                write_chunk(f"full-{index}-{chunk_index}", encoded)
                full.append(len(encoded))
    except datasets.SequenceError as error:
        return SequenceFrames(reason=f"No frames: {error}")
    return SequenceFrames(thumbnails, full, shapes=shapes)
