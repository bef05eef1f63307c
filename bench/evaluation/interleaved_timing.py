"""Interleaved timing: trackers take turns of a few frames, each in its own process.

Other load of the machine thus affects all trackers equally. A process can run a tracker of any git
revision; only the tracker interface is required. `take_turns` also times objects in this process
that implement `Side`. The clock is that of `trackers.base.call_clock`.
"""

import gc
import importlib.util
import json
import os
import select
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import inf
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.process_tree import ProcessTree

ANSWER_SECONDS = 600.0
"""Time limit of a turn, including compilation [s]."""

_TURN_SECONDS = 0.002
_PASSES_SECONDS = 2.0  # time of all passes of the slowest side
_MIN_PASSES, _MAX_PASSES = 3, 100  # passes
_LONGEST = 1 << 20  # bytes of an answer
_MAX_REPEATS = 3  # repetitions of a pass that other load disturbs


def _load_clock() -> Any:
    """Return the module of the clock, without the package `trackers`: it can be of a revision."""
    file = Path(__file__).parents[2] / "trackers/base/call_clock.py"
    spec = importlib.util.spec_from_file_location("trackmark_call_clock", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


_call_clock = _load_clock()

CLOCK = _call_clock.CallClock()
"""Clock of the turns in this process."""


class TurnError(Exception):
    """Error: a tracker cannot be timed; the message has one line."""


@dataclass(frozen=True)
class Setup:
    """Name and options of a tracker that a process runs."""

    name: str
    options: Mapping[str, str] | None = None
    home: str = ""  # folder of the package `trackers`; empty for this package
    revision: str = ""  # git revision of the tracker, for messages
    swapped: Sequence[str] = ()  # folder in the module path, and the folder that replaces it


@dataclass(frozen=True)
class Clip:
    """Part of a sequence on disk."""

    images: str  # .npy file with all images, also those before the init box
    first: int  # index of the image of the init box
    box: Sequence[float]
    frames: int  # number of frames after that image
    mask: str  # .npy file of the init mask; empty for none
    seed: Sequence[int]  # spawn key of the seed sequence


class TurnTime(NamedTuple):
    """Time of a turn without run delay, and the run delay [s]."""

    seconds: float
    run_delay: float


class Reference:
    """Fixed computations, whose time shows the machine's speed during timing runs."""

    def init(self, *_: object) -> None:
        """Make the input image."""
        random = np.random.default_rng(0)
        self._image = random.integers(0, 256, (240, 320, 3), np.uint8)
        self._weights = random.random(256).astype(np.float32)

    def update(self, *_: object) -> float:
        """Perform typical computations of a tracker."""
        import cv2

        hue = cv2.cvtColor(self._image, cv2.COLOR_BGR2HSV)[..., 0]
        counts = np.bincount(hue.ravel(), minlength=256)
        smooth = cv2.blur(self._weights[hue], (5, 5))
        total = float(smooth.sum())
        for count in counts.tolist() * 10:
            total += count * 0.5
        return total


class _ClipRunner:
    """Tracker of this process, which is timed on clips."""

    def __init__(self, setup: Setup, clips: Sequence[Clip]) -> None:
        self._setup, self._clips = setup, clips
        self._images = [np.load(clip.images, mmap_mode="r") for clip in clips]

    def turn(self, number: int, start: int, stop: int) -> TurnTime:
        """See `Side`."""
        clip, images = self._clips[number], self._images[number]
        if start == 0:
            seed = np.random.SeedSequence(0, spawn_key=tuple(clip.seed))
            create = importlib.import_module("trackmark.trackers").create
            self._tracker = create(self._setup.name, seed, **(self._setup.options or {}))
            if hasattr(self._tracker, "watch"):
                for frame in range(clip.first):
                    self._tracker.watch(_frozen(images[frame]))
            mask = np.load(clip.mask) if clip.mask else None
            self._tracker.init(_frozen(images[clip.first]), np.array(clip.box, float), mask)
        clip_images = [_frozen(image) for image in images[clip.first + 1 :][start:stop]]
        return time_updates(self._tracker, clip_images)


def time_updates(tracker: Any, images: Iterable[Any]) -> TurnTime:
    """Return the time of the updates of a tracker on images."""
    update = tracker.update
    CLOCK.start()
    for image in images:
        update(image)
    _call_clock.synchronise(tracker)
    call = CLOCK.stop()
    return TurnTime(call.seconds, call.run_delay)


def _frozen(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a read-only copy of an image."""
    copy = np.array(image)
    copy.flags.writeable = False
    return copy


@contextmanager
def one_thread() -> Iterator[None]:
    """Disable OpenCV's threads and Python's garbage collector."""
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
    """Run the process of a tracker: write a line with the seconds of each requested turn."""
    import cv2

    arguments = json.loads(sys.argv[2])
    setup, clips = Setup(**arguments["setup"]), [Clip(**clip) for clip in arguments["clips"]]
    if setup.home:
        sys.path.insert(0, setup.home)  # revisions before `trackmark.trackers` import `trackers`
        sys.modules["trackmark"].__path__.insert(0, setup.home)
    if setup.swapped:
        now, then = setup.swapped
        sys.path[:] = [then if os.path.realpath(entry) == now else entry for entry in sys.path]
    cv2.setNumThreads(1)
    runner = _ClipRunner(setup, clips)
    with os.fdopen(int(sys.argv[1]), "w", encoding="ascii") as answers:
        gc.disable()
        for turns, line in enumerate(sys.stdin):
            try:
                answer: Any = runner.turn(*json.loads(line))
            except BaseException as error:  # noqa: BLE001  # of the tracker
                answer = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            answers.write(json.dumps(answer) + "\n")
            answers.flush()
            gc.collect()
            if turns < len(clips):  # keeps imported modules out of later garbage collections
                gc.freeze()
    os._exit(0)  # skips exit handlers of a tracker, which could wait


class _Process:
    """Process that runs a tracker."""

    def __init__(self, setup: Setup, clips: Sequence[Clip]) -> None:
        self._answers, theirs = os.pipe()
        self._revision = setup.revision
        arguments = {"setup": asdict(setup), "clips": [asdict(clip) for clip in clips]}
        self._child = ProcessTree.run_module(
            "trackmark.bench.evaluation.interleaved_timing",
            [theirs, json.dumps(arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=[theirs],
        )
        os.close(theirs)
        assert self._child.process.stdin is not None
        self._pipe = self._child.process.stdin

    def turn(self, number: int, start: int, stop: int) -> TurnTime:
        """See `Side`; raises `TurnError`."""
        try:
            self._pipe.write(json.dumps([number, start, stop]).encode() + b"\n")
            self._pipe.flush()
            answer = json.loads(self._line())
        except (OSError, ValueError):
            answer = "its process ended or wrote an invalid message"
        if isinstance(answer, list):
            time = TurnTime(*answer)
            if 0 < time.seconds < inf:
                return time
            answer = time.seconds
        reason = answer if isinstance(answer, str) else f"{answer!r:.100} is not a duration"
        raise TurnError(f"as of {self._revision}, {reason}" if self._revision else reason)

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
        with suppress(OSError):  # the process has not read all input
            self._pipe.close()
        self._child.end()


def time_interleaved(setups: Sequence[Setup], clips: Sequence[Clip]) -> NDArray[np.float64]:
    """Time trackers on the same clips, in new processes.

    Return the seconds of the updates, shape (setups, passes, turns), without the warm-up.

    Raises `TurnError` if a tracker cannot be timed.
    """
    with ExitStack() as processes:
        sides: list[_Process] = []
        for setup in setups:
            sides.append(side := _Process(setup, clips))
            processes.callback(side.end)
        return take_turns(sides, [clip.frames for clip in clips]).seconds


class Side(Protocol):
    """Object that `take_turns` can time."""

    def turn(self, number: int, start: int, stop: int) -> TurnTime:
        """Return the time of updates `start` to `stop`; 0 creates a new tracker."""
        ...


class Turns(NamedTuple):
    """Times without run delay (sides, passes, turns) [s]; and clip, start, stop of each turn."""

    seconds: NDArray[np.float64]
    turns: list[tuple[int, int, int]]


def take_turns(
    sides: Sequence[Side],
    frames: Sequence[int],
    fewest: int = _MIN_PASSES,
    seconds: float = _PASSES_SECONDS,
) -> Turns:
    """Time objects that take turns, after a warm-up.

    `frames` is the number of frames of each clip. `fewest` is the minimum number of passes.
    `seconds` is the total time of all passes of the slowest object [s].
    """
    for most in (2, max(frames)):  # compiles kernels, then fills caches
        warming = [(number, 0, min(most, stop)) for number, stop in enumerate(frames)]
        sums = _pass(sides, warming, 0)[..., 0].sum(axis=1)
    passes = min(max(round(seconds / sums.max()), fewest), _MAX_PASSES)
    # Every turn takes longer than it takes to fill the CPU caches again.
    turns_per_clip = max(1, round(sums.min() / len(frames) / _TURN_SECONDS))
    turns = []
    for number, stop in enumerate(frames):
        edges = np.linspace(0, stop, min(turns_per_clip, stop) + 1).round().astype(int)
        turns += [(number, *edge) for edge in pairwise(edges.tolist())]
    measured = [_undisturbed_pass(sides, turns, number) for number in range(passes)]
    return Turns(np.stack(measured, axis=1), turns)


def _undisturbed_pass(
    sides: Sequence[Side], turns: Sequence[tuple[int, int, int]], first: int
) -> NDArray[np.float64]:
    """Return the seconds of a pass, shape (sides, turns).

    A pass that other load disturbs is repeated. If other load disturbs all repetitions, the one
    with the smallest run delay counts.
    """
    best, smallest_share = np.empty(0), inf
    for _ in range(1 + _MAX_REPEATS):
        times = _pass(sides, turns, first)
        share = _call_clock.run_delay_share(*times.sum(axis=(0, 1)).tolist())
        if share < smallest_share:
            best, smallest_share = times[..., 0], share
        if share <= _call_clock.MAX_RUN_DELAY:
            break
    return best


def _pass(
    sides: Sequence[Side], turns: Sequence[tuple[int, int, int]], first: int
) -> NDArray[np.float64]:
    """Return seconds and run delays, (sides, turns, 2); the first side rotates by turns."""
    times = np.empty((len(sides), len(turns), 2))
    for place, turn in enumerate(turns):
        for step in range(len(sides)):
            number = (first + place + step) % len(sides)
            times[number, place] = sides[number].turn(*turn)
    return times
