"""Frames of a page, read from sequences that have not changed since their runs."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import accumulate, count
from typing import Any

from trackmark import datasets
from trackmark.bench.execution.pool import map_in_workers
from trackmark.bench.pages.content import PlayerSequence
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


def with_frames(
    sequences: Sequence[PlayerSequence],
    progress: Progress,
    write_chunk: ChunkWriter | None = None,
    height: int = THUMBNAIL,
    selected: Sequence[Sequence[int]] | None = None,
) -> list[PlayerSequence]:
    """Return sequences with all frames, or with the `selected` frames of each, in order.

    Frames inside the page have a height [px] of at most `height`. Full-size frames are passed to
    `write_chunk`, which worker processes call and which can thus be pickled.
    """
    frames_of = selected or [range(sequence.n_frames) for sequence in sequences]
    ends = [*accumulate(map(len, frames_of))]
    encode = partial(_encode_sequence, write_chunk=write_chunk, height=height)
    names = "sequence", "source", "truth", "fingerprint"
    rows = [{name: sequence.row[name] for name in names} for sequence in sequences]
    requests = [*zip(count(), rows, frames_of, strict=False)]
    encoded: Iterable[Mapping[str, Any]] = map(encode, requests)
    if len(rows) > 1 and ends[-1] + _OPENING_COST * len(rows) >= _MIN_FRAMES_FOR_WORKERS:
        encoded = map_in_workers(encode, requests, min(os.cpu_count() or 1, len(rows)))
    filled = []
    for sequence, frames, end, fields in zip(sequences, frames_of, ends, encoded, strict=True):
        is_complete = len(frames) == sequence.n_frames
        shapes = {**fields.get("shapes", {}), **sequence.shapes}
        filled.append(
            replace(
                sequence,
                frame_numbers=None if is_complete else frames,
                **{**fields, "shapes": shapes},
            )
        )
        progress(end, ends[-1])
    return filled


def _encode_sequence(
    request: tuple[int, Mapping[str, Any], Sequence[int]],
    *,
    write_chunk: ChunkWriter | None,
    height: int,
) -> dict[str, Any]:
    """Return the fields of `PlayerSequence` with the frames of a sequence, or why there are none.

    `request`: index of the sequence, row of a run, and frames. The outlines of masks are read from
    the sequence, as they may not be stored.
    """
    index, row, frames = request
    if not frames:
        return {}
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
        return {"reason": f"No frames: {error}"}
    return {"thumbnails": thumbnails, "full": full, "shapes": shapes}
