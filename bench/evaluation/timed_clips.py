"""Tracker that is timed on clips: in a process of its own, or in the process of a report.

This module does not import the package `trackers`, because a process can run a tracker of any git
revision, whose package replaces the current one. The clock is that of `trackers.base.call_clock`.
"""

import gc
import importlib
import importlib.util
import json
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray


def _load_clock() -> Any:
    """Return the current module of the clock."""
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
    n_frames: int  # number of frames after that image
    mask: str  # .npy file of the init mask; empty for none
    seed: Sequence[int]  # spawn key of the seed sequence


class TurnTime(NamedTuple):
    """Time of a turn without run delay, and the run delay [s]."""

    seconds: float
    run_delay: float


class TimedClips:
    """Operations of `external/worker.py` on the tracker of a setup, which is timed on clips.

    `arguments` are the fields of the setup and of the clips, as JSON.
    """

    def __init__(self, frames: Any, arguments: str) -> None:
        frames.close()  # the images are those of the clips
        setup, clips = json.loads(arguments)
        self._setup, self._clips = Setup(**setup), [Clip(**clip) for clip in clips]
        if home := self._setup.home:
            sys.path.insert(0, home)  # revisions before `trackmark.trackers` import `trackers`
            sys.modules["trackmark"].__path__.insert(0, home)
        if self._setup.swapped:
            now, then = self._setup.swapped
            sys.path[:] = [then if os.path.realpath(path) == now else path for path in sys.path]
        self._images = [np.load(clip.images, mmap_mode="r") for clip in self._clips]
        self._n_turns = 0
        cv2.setNumThreads(1)
        gc.disable()

    def perform(self, operation: str, **turn: int) -> dict[str, Any]:
        """Return the times of a turn, which is the only operation; then collect garbage."""
        try:
            times: dict[str, Any] = self._time(**turn)._asdict()
        except BaseException as error:  # noqa: BLE001  # of the tracker
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            return {"unusable": reason[:300]}
        gc.collect()
        self._n_turns += 1
        if self._n_turns <= len(self._clips):
            gc.freeze()  # keeps imported modules out of later garbage collections
        return times

    def _time(self, clip_index: int, start: int, stop: int) -> TurnTime:
        """Return the time of the updates `start` to `stop` on a clip; 0 creates a new tracker."""
        clip, images = self._clips[clip_index], self._images[clip_index]
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
