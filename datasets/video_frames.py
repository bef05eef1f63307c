"""Frames of a video file: fast in order, exact to the bit in any order."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.container import InputContainer
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter

from trackmark.datasets.decoding import check_pixels, decoding, pixel_limit
from trackmark.datasets.interface import Image, SequenceError


class _DecodeError(Exception):
    """A frame came damaged, or did not come."""


class VideoFrames:
    """Frames of a video file's first video stream, as BGR, upright as a player shows them.

    Opening reads the file's packets once and decodes none: frames are numbered in the order
    of their presentation times, which also says where decoding may begin. Where a file has
    no such times to rely on (AVI stores none, which shows when frames are reordered), the
    frames are counted by decoding, and a step back decodes from the start.

    `file`: The video file. `most_pixels`: A video of larger images is refused; see
    `datasets.decoding.pixel_limit`. `fps`: Mean frames a second. Raises `SequenceError` for a file
    that holds no video, or none that can be decoded.
    """

    def __init__(self, file: Path, most_pixels: int | None = None) -> None:
        self._file = file
        self._most_pixels = most_pixels
        self._times: list[int] = []
        self._keys = [0]
        self._next = 0
        self._decoding: Iterator[VideoFrame] = iter(())
        self._converter = VideoReformatter()
        with decoding(f"{file}: this can't be read as video"):
            self._index()

    def __copy__(self) -> "VideoFrames":
        """Return frames of the same file with a position of their own; the index is shared."""
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
        advice = "Get the file anew, or end the truth before this frame."
        with decoding(f"{self._file}: frame {frame} can't be decoded", advice):
            try:
                decoded = self._advance(frame)
            except (av.FFmpegError, _DecodeError):
                # Not every container finds a key frame by its time.
                self._start(0)
                decoded = self._advance(frame)
            image = self._converter.reformat(decoded, format="bgr24").to_ndarray()
            # A telephone held upright stores frames that lie on their side, and says so.
            upright = np.rot90(image, round(decoded.rotation / 90))
            return np.ascontiguousarray(upright, dtype=np.uint8)

    def _index(self) -> None:
        """Find out how many frames there are, when each is shown, and which are key frames."""
        with self._opened() as container:
            if not container.streams.video:
                raise SequenceError(f"{self._file}: there is no video in this file.")
            stream = container.streams.video[0]
            if stream.codec_context is None:
                raise SequenceError(
                    f"{self._file}: no decoder is known for this video's codec. Convert it, "
                    "to H.264 for example."
                )
            check_pixels(stream.codec_context.width, stream.codec_context.height, self._most_pixels)
            rate = stream.average_rate
            self.fps = float(rate) if rate else None
            reordered = stream.codec_context.has_b_frames
            packets = [
                (packet.pts, packet.is_keyframe)
                for packet in container.demux(stream)
                if packet.size and not packet.is_discard
            ]
        times = [time for time, _ in packets if time is not None]
        keys = [time for time, is_key in packets if is_key and time is not None]
        if len(set(times)) < len(packets) or (reordered and times == sorted(times)):
            self._count = sum(1 for _ in self._decode(0))
            return
        self._times = sorted(times)
        self._keys = sorted({0, *(bisect_left(self._times, time) for time in keys)})
        self._count = len(self._times)

    def _opened(self) -> InputContainer:
        options: dict[str, Any] = {}
        if int(av.__version__.partition(".")[0]) < 19:
            # A title in Latin-1 is no reason to refuse a video. PyAV 19 keeps such bytes itself.
            options["metadata_errors"] = "replace"
        container: InputContainer = av.open(self._file, **options)
        return container

    def _start(self, key: int) -> None:
        """Decode from a key frame on."""
        self._decoding = self._decode(key)
        self._next = key

    def _advance(self, frame: int) -> VideoFrame:
        """Decode up to a frame."""
        while True:
            decoded = next(self._decoding, None)
            if decoded is None:
                raise _DecodeError("the file ends before")
            self._next += 1
            if self._next > frame:
                return decoded

    def _decode(self, key: int) -> Iterator[VideoFrame]:
        """Frames in order from a key frame on."""
        with self._opened() as container:
            stream = container.streams.video[0]
            stream.thread_type = "NONE"
            # Else frames that refer to a damaged one, but are shown before it, come as if whole.
            stream.codec_context.options = {
                "err_detect": "explode",
                # Of a stream that grows; twice, for the margins that decoders count.
                "max_pixels": str(2 * pixel_limit(self._most_pixels)),
            }
            if key:
                container.seek(self._times[key], stream=stream)
            expected = key
            for decoded in container.decode(stream):
                if self._times and decoded.pts != self._times[expected]:
                    if expected == key:
                        continue  # a seek may land early
                    raise _DecodeError("it is missing")
                if decoded.is_corrupt:
                    raise _DecodeError("it is damaged")
                yield decoded
                expected += 1
