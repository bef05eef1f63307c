"""Frames of a video file; access is fastest in temporal order, and exact in any order."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import av
import av.logging
import numpy as np
from av.container import InputContainer
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter

from trackmark.datasets.decoding import check_pixels, decoding, pixel_limit
from trackmark.datasets.interface import Image, SequenceError


class _DecodeError(Exception):
    """Error of a frame that is damaged or missing."""


@contextmanager
def _log_of_decoder() -> Iterator[list[tuple[int, str, str]]]:
    """Provide the errors that FFmpeg logs meanwhile in this thread: level, source, message."""
    level, skips_repeated = av.logging.get_level(), av.logging.get_skip_repeated()
    av.logging.set_level(av.logging.ERROR)
    av.logging.set_skip_repeated(False)  # otherwise, a second reading would be without errors
    try:
        with av.logging.Capture() as messages:
            yield messages
    finally:
        av.logging.set_level(level)
        av.logging.set_skip_repeated(skips_repeated)


def _without_logged_errors(frames: Iterator[VideoFrame]) -> Iterator[VideoFrame]:
    """Yield decoded frames; raise `_DecodeError` if FFmpeg logs an error that it does not raise.

    An example are wrong checksums of FFV1, after which FFmpeg returns the damaged frame.
    """
    while True:
        with _log_of_decoder() as messages:
            frame = next(frames, None)
        errors = [text.strip() for level, _, text in messages if level <= av.logging.ERROR]
        if errors:
            raise _DecodeError(errors[0])
        if frame is None:
            return
        yield frame


class VideoFrames:
    """Frames of the first video stream of a file, in BGR, rotated upright as a player shows them.

    Opening reads the packets once and decodes none. Frames are numbered in the order of their
    presentation times, and decoding starts at the last key frame before a frame. AVI files have no
    presentation times. If their codec reorders frames, frames are counted by decoding, and a step
    back decodes from the start.

    Attributes
    ----------
    fps : float or None
        Mean frame rate [frames/s].

    Raises
    ------
    SequenceError
        If the file contains no video, a video that cannot be decoded, or images that
        are larger than `datasets.decoding.pixel_limit`.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._times: list[int] = []
        self._keys = [0]
        self._next = 0
        self._decoding: Iterator[VideoFrame] = iter(())
        self._converter = VideoReformatter()
        with decoding(f"{file}: cannot be read as video"):
            self._index()

    def __copy__(self) -> "VideoFrames":
        """Return frames of the same file with an independent decoding position."""
        other = object.__new__(type(self))
        other.__dict__ |= self.__dict__
        other._next, other._decoding, other._converter = 0, iter(()), VideoReformatter()
        return other

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, frame: int) -> Image:
        """See `Frames`."""
        key = self._keys[bisect_right(self._keys, frame) - 1]
        if not key <= self._next <= frame:
            self._start(key)
        remedy = "Download the file again, or end the ground truth before this frame."
        with decoding(f"{self._file}: frame {frame} cannot be decoded", remedy):
            try:
                decoded = self._advance(frame)
            except (av.FFmpegError, _DecodeError):
                # In some containers, a seek does not find a key frame by its time.
                self._start(0)
                decoded = self._advance(frame)
            image = self._converter.reformat(decoded, format="bgr24").to_ndarray()
            # Phones that are held upright store sideways frames with a rotation.
            upright = np.rot90(image, round(decoded.rotation / 90))
            return np.ascontiguousarray(upright, dtype=np.uint8)

    def _index(self) -> None:
        """Read the number of frames, their presentation times and the key frames."""
        with self._opened() as container:
            if not container.streams.video:
                raise SequenceError(f"{self._file}: the file contains no video.")
            stream = container.streams.video[0]
            if stream.codec_context is None:
                raise SequenceError(
                    f"{self._file}: there is no decoder for this video's codec. Convert the video, "
                    "for example to H.264."
                )
            check_pixels(stream.codec_context.width, stream.codec_context.height)
            rate = stream.average_rate
            self.fps = float(rate) if rate else None
            reordered = stream.codec_context.has_b_frames
            n_packets, times, keys = 0, list[int](), list[int]()
            for packet in container.demux(stream):
                if not packet.size or packet.is_discard:
                    continue
                n_packets += 1
                if packet.pts is not None:
                    times.append(packet.pts)
                    keys += [packet.pts] if packet.is_keyframe else []
        if len(set(times)) < n_packets or (reordered and times == sorted(times)):
            self._count = sum(1 for _ in self._decode(0))
            return
        self._times = sorted(times)
        self._keys = sorted({0, *(bisect_left(self._times, time) for time in keys)})
        self._count = len(self._times)

    def _opened(self) -> InputContainer:
        options: dict[str, Any] = {}
        if int(av.__version__.partition(".")[0]) < 19:
            # Accept titles that are not UTF-8. Since PyAV 19, no option is needed.
            options["metadata_errors"] = "replace"
        container: InputContainer = av.open(self._file, **options)
        return container

    def _start(self, key: int) -> None:
        """Restart decoding at a key frame."""
        self._decoding = self._decode(key)
        self._next = key

    def _advance(self, frame: int) -> VideoFrame:
        """Decode up to a frame and return it."""
        while True:
            decoded = next(self._decoding, None)
            if decoded is None:
                raise _DecodeError("the file ends before this frame")
            self._next += 1
            if self._next > frame:
                return decoded

    def _decode(self, key: int) -> Iterator[VideoFrame]:
        """Yield the frames in order, starting at a key frame."""
        with self._opened() as container:
            stream = container.streams.video[0]
            stream.thread_type = "NONE"
            # Otherwise, frames that depend on a damaged later frame would be decoded without error.
            # `crccheck` compares HEVC pictures with their hashes, if the file contains any.
            stream.codec_context.options = {
                "err_detect": "crccheck+explode",
                # The image size may grow in a stream. The limit is doubled, because decoders add
                # margins.
                "max_pixels": str(2 * pixel_limit()),
            }
            if key:
                container.seek(self._times[key], stream=stream)
            expected = key
            for decoded in _without_logged_errors(container.decode(stream)):
                if self._times and decoded.pts != self._times[expected]:
                    if expected == key:
                        continue  # A seek may end before the key frame.
                    raise _DecodeError("the frame is missing")
                if decoded.is_corrupt:
                    raise _DecodeError("the frame is damaged")
                yield decoded
                expected += 1
