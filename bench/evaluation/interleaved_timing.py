"""Trackers clocked in turns, frames by frames, each in a process of its own (`in_turns`).

What else the machine does then hits all alike. The process performs a tracker of whatever
revision, so it asks of it nothing but the protocol of trackers, and no version of the harness.
`take_turns` is the same for whatever can be asked for a turn, in this process, too.
"""

import gc
import importlib
import json
import os
import select
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import inf
from time import monotonic, thread_time
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.process_tree import Offspring

ANSWER_SECONDS = 600.0
"""Within which a turn must be over: compiling, too."""

_TURN_SECONDS = 0.002
_PASSES_SECONDS = 2.0  # that the passes together should take on either side
_FEWEST, _MOST = 3, 100  # passes
_LONGEST = 1 << 20  # bytes of an answer


class TurnError(Exception):
    """A tracker that can't be clocked; says why in a line."""


@dataclass(frozen=True)
class Setup:
    """Tracker that a process runs, by name and options."""

    name: str
    options: Mapping[str, str] | None = None
    home: str = ""  # folder that holds the package `trackers`, where it is not this one's
    revision: str = ""  # that it is of, for messages
    swapped: Sequence[str] = ()  # a folder of the module path, and what takes its place there


@dataclass(frozen=True)
class Clip:
    """A stretch of a sequence on disk: images, those before the first box included."""

    images: str  # .npy
    first: int  # image with the first box
    box: Sequence[float]
    frames: int  # after that image
    mask: str  # .npy, or none
    seed: Sequence[int]  # the seed sequence's spawn key


class Reference:
    """Fixed work similar to that of trackers; timing runs store its time as the machine's speed."""

    def init(self, *_: object) -> None:
        """Make the image that it works on."""
        random = np.random.default_rng(0)
        self._image = random.integers(0, 256, (240, 320, 3), np.uint8)
        self._weights = random.random(256).astype(np.float32)

    def update(self, *_: object) -> float:
        """Convert colours, count them, look weights up, smooth, and go through a list."""
        import cv2

        hue = cv2.cvtColor(self._image, cv2.COLOR_BGR2HSV)[..., 0]
        counts = np.bincount(hue.ravel(), minlength=256)
        smooth = cv2.blur(self._weights[hue], (5, 5))
        total = float(smooth.sum())
        for count in counts.tolist() * 10:
            total += count * 0.5
        return total


class Performance:
    """A tracker that is shown clips."""

    def __init__(self, setup: Setup, clips: Sequence[Clip]) -> None:
        self._setup, self.clips = setup, clips
        self._images = [np.load(clip.images, mmap_mode="r") for clip in clips]
        self._tracker: Any = None

    def turn(self, number: int, start: int, stop: int) -> float:
        """CPU seconds of its updates on some of a clip's images after the first box.

        From 0 on it begins anew.
        """
        clip = self.clips[number]
        if start == 0:
            self._tracker = self._made(clip)
            self._begin(clip, self._images[number])
        after = self._images[number][clip.first + 1 :]
        images = [_frozen(image) for image in after[start:stop]]
        update = self._tracker.update
        began = thread_time()
        for image in images:
            update(image)
        return thread_time() - began

    def _made(self, clip: Clip) -> Any:
        seed = np.random.SeedSequence(0, spawn_key=tuple(clip.seed))
        create = importlib.import_module("trackmark.trackers").create
        return create(self._setup.name, seed, **(self._setup.options or {}))

    def _begin(self, clip: Clip, images: NDArray[np.uint8]) -> None:
        if hasattr(self._tracker, "watch"):
            for frame in range(clip.first):
                self._tracker.watch(_frozen(images[frame]))
        mask = np.load(clip.mask) if clip.mask else None
        self._tracker.init(_frozen(images[clip.first]), np.array(clip.box, float), mask)


def _frozen(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """In memory of its own, as a decoder gives it."""
    copy = np.array(image)
    copy.flags.writeable = False
    return copy


@contextmanager
def one_thread() -> Iterator[None]:
    """Without OpenCV's own threads and Python's garbage collector."""
    import cv2

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        cv2.setNumThreads(threads)


def main() -> None:
    """Perform in the child: a line of seconds for each turn that is asked for."""
    import cv2

    told = json.loads(sys.argv[2])
    setup = Setup(**told["setup"])
    if setup.home:
        sys.path.insert(0, setup.home)  # revisions before `trackmark.trackers` import `trackers`
        sys.modules["trackmark"].__path__.insert(0, setup.home)
    if setup.swapped:
        now, then = setup.swapped
        sys.path[:] = [then if os.path.realpath(entry) == now else entry for entry in sys.path]
    cv2.setNumThreads(1)
    performance = Performance(setup, [Clip(**clip) for clip in told["clips"]])
    with os.fdopen(int(sys.argv[1]), "w", encoding="ascii") as answers:
        gc.disable()
        for turns, line in enumerate(sys.stdin):
            try:
                answer: Any = performance.turn(*json.loads(line))
            except BaseException as error:  # noqa: BLE001  # whatever a tracker does
                answer = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            answers.write(json.dumps(answer) + "\n")
            answers.flush()
            gc.collect()
            if turns < len(performance.clips):  # what was imported lives for good
                gc.freeze()
    os._exit(0)  # whatever a tracker wants to be done, or waits for, at the end


class _Side:
    """A process that performs, and what it is asked."""

    def __init__(self, setup: Setup, clips: Sequence[Clip]) -> None:
        self._answers, theirs = os.pipe()
        self._revision = setup.revision
        told = json.dumps({"setup": asdict(setup), "clips": [asdict(clip) for clip in clips]})
        self._child = Offspring(
            "trackmark.bench.evaluation.interleaved_timing",
            [theirs, told],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=[theirs],
        )
        os.close(theirs)
        assert self._child.process.stdin is not None
        self._pipe = self._child.process.stdin

    def turn(self, number: int, start: int, stop: int) -> float:
        """Ask, and wait for the answer; raises `TurnError` with what went wrong."""
        try:
            self._pipe.write(json.dumps([number, start, stop]).encode() + b"\n")
            self._pipe.flush()
            answer = json.loads(self._line())
        except (OSError, ValueError):
            answer = "its process ended, or wrote no sense"
        if isinstance(answer, float) and 0 < answer < inf:
            return answer
        said = answer if isinstance(answer, str) else f"{answer!r:.100} is no time"
        raise TurnError(f"as of {self._revision}, {said}" if self._revision else said)

    def _line(self) -> bytes:
        line, until = b"", monotonic() + ANSWER_SECONDS
        while not line.endswith(b"\n"):
            ready, _, _ = select.select([self._answers], [], [], max(0.0, until - monotonic()))
            if not ready:
                return json.dumps(f"nothing happens for {ANSWER_SECONDS:g} s").encode()
            line += (more := os.read(self._answers, 1 << 16))
            if not more or len(line) > _LONGEST:
                raise ValueError(line)
        return line

    def end(self) -> None:
        """End the process."""
        os.close(self._answers)
        with suppress(OSError):  # of what was not read any more
            self._pipe.close()
        self._child.end()


def in_turns(setups: Sequence[Setup], clips: Sequence[Clip]) -> NDArray[np.float64]:
    """Clock setups on the same images, in fresh processes.

    Parameters
    ----------
    setups : sequence of Setup
        What is compared.
    clips : sequence of Clip
        Shown one after another, several times.

    Returns
    -------
    array of float64, shape (setups, passes, turns)
        CPU seconds of the updates of a turn. What warms up is left out.

    Raises
    ------
    TurnError
        With the reason, where one can't be clocked.
    """
    with ExitStack() as processes:
        sides: list[_Side] = []
        for setup in setups:
            sides.append(side := _Side(setup, clips))
            processes.callback(side.end)
        return take_turns(sides, [clip.frames for clip in clips]).seconds


class Side(Protocol):
    """What can be asked for a turn."""

    def turn(self, number: int, start: int, stop: int) -> float:
        """CPU seconds of these updates on a clip; from 0 on it begins anew."""
        ...


class Turns(NamedTuple):
    """CPU seconds, shape (sides, passes, turns), and each turn's clip, first and last image."""

    seconds: NDArray[np.float64]
    turns: list[tuple[int, int, int]]


def take_turns(
    sides: Sequence[Side],
    frames: Sequence[int],
    fewest: int = _FEWEST,
    seconds: float = _PASSES_SECONDS,
) -> Turns:
    """Clock sides, after what warms up.

    `frames`: of each clip. `fewest`: passes that are made at least, as many as the slowest side
    takes these `seconds` for.
    """
    for most in (2, max(frames)):  # compiling first; then all, to warm up
        warming = [(number, 0, min(most, stop)) for number, stop in enumerate(frames)]
        sums = _pass(sides, warming, 0).sum(axis=1)
    passes = min(max(round(seconds / sums.max()), fewest), _MOST)
    # On either side, a turn is longer than what it takes to get back into the caches.
    a_clip = max(1, round(sums.min() / len(frames) / _TURN_SECONDS))
    turns = []
    for number, stop in enumerate(frames):
        edges = np.linspace(0, stop, min(a_clip, stop) + 1).round().astype(int)
        turns += [(number, *edge) for edge in pairwise(edges.tolist())]
    return Turns(np.stack([_pass(sides, turns, n) for n in range(passes)], axis=1), turns)


def _pass(
    sides: Sequence[Side], turns: Sequence[tuple[int, int, int]], first: int
) -> NDArray[np.float64]:
    """All turns once; who is asked first alternates among turns, and among passes."""
    seconds = np.empty((len(sides), len(turns)))
    for place, turn in enumerate(turns):
        for step in range(len(sides)):
            number = (first + place + step) % len(sides)
            seconds[number, place] = sides[number].turn(*turn)
    return seconds
