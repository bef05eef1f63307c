"""Trackers of Python files in another interpreter: the parent's side of `worker.py`.

A process that has run a tracker is reused for the next tracker of the same file, because importing
a library such as PyTorch takes seconds. A process that failed or was interrupted is not reused.
"""

import json
import os
import signal
import tempfile
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from trackmark.bench.external.plugin import ExternalPlugin
from trackmark.bench.external.process import ExternalTrackerError, LineProcess, frame_file_options
from trackmark.bench.external.worker import pack, unpack
from trackmark.trackers import Box, Estimate, Image, Mask, Randomness
from trackmark.trackers.base.plain import create_parameters, random_arguments, to_estimate

WORKER = Path(__file__).with_name("worker.py")


@dataclass(frozen=True)
class PythonClass:
    """Tracker class of a file, the interpreter that runs it, and time limits.

    `class_name` is empty if the file has one tracker. `digest` identifies the file's content: a
    process that imported another content is not reused.
    """

    python: str
    file: Path
    class_name: str
    digest: str
    environment: tuple[tuple[str, str], ...]
    start_seconds: float
    frame_seconds: float

    def command(self, frames: int) -> list[str]:
        """Return the command that starts the worker; a crash prints the stack of Python.

        `frames`: descriptor of the file with the image of each request.
        """
        options = ["-X", "faulthandler", "-u"]
        arguments = [str(WORKER), str(frames), str(self.file), self.class_name]
        return [self.python, *options, *filter(None, arguments)]


class _Session:
    """Worker process, and the file through which it receives frames."""

    def __init__(self, tracker: PythonClass) -> None:
        # The file has no name, so that nothing is left if this process is killed.
        self._frames = tempfile.TemporaryFile(**frame_file_options(), buffering=0)  # noqa: SIM115  # closed below
        weakref.finalize(self, self._frames.close)
        frames = self._frames.fileno()
        self._process = LineProcess(
            tracker.command(frames),
            environment=dict(tracker.environment),
            pass_fds=[frames],
            stack_signal=signal.SIGUSR1,
        )
        self.is_usable = True  # False while an answer is pending
        self.description = self.ask(tracker.start_seconds, "describe")

    def ask(
        self, seconds: float, operation: str, image: Image | None = None, **arguments: Any
    ) -> dict[str, Any]:
        """Return the answer to a request; raise `ExternalTrackerError` if it fails."""
        self.is_usable = False
        if image is not None:
            arguments["shape"] = image.shape
            data = np.ascontiguousarray(image).data
            # Writing reports a full disk as an error; through a memory map, it would be a signal.
            if os.pwrite(self._frames.fileno(), data, 0) != image.nbytes:
                raise ExternalTrackerError("the frame cannot be written: no space left in memory.")
        request = json.dumps({"op": operation, **arguments}, default=int)
        self._process.send(request.encode() + b"\n", seconds)
        line = self._process.read_line(seconds)
        try:
            answer: dict[str, Any] = json.loads(line)
        except ValueError:
            raise self._process.fail(f"answered with {line[:80]!r}. Expected: JSON") from None
        if "error" in answer:
            raise self._process.fail(f"raised {answer['error']}")
        self.is_usable = True
        return answer

    def close(self) -> None:
        self._process.close()
        self._frames.close()


_idle: dict[tuple[int, PythonClass], list[_Session]] = {}
"""Sessions without a tracker, by process id (of this process) and tracker class."""


def _take(tracker: PythonClass) -> _Session:
    idle = _idle.get((os.getpid(), tracker))
    return idle.pop() if idle else _Session(tracker)


def _give_back(tracker: PythonClass, session: _Session) -> None:
    if session.is_usable:
        _idle.setdefault((os.getpid(), tracker), []).append(session)
    else:
        session.close()


def close_idle_processes() -> None:
    """End the processes that wait for the next tracker of their file."""
    for sessions in _idle.values():
        while sessions:
            sessions.pop().close()


class PythonPlugin(ExternalPlugin):
    """Plugin of a class in another interpreter; see `load_plugin`."""

    tracker: ClassVar[PythonClass]

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        super().__init__(parameters, seed)
        self._session = _take(self.tracker)
        self._release = weakref.finalize(self, _give_back, self.tracker, self._session)
        self._session.ask(
            self.tracker.start_seconds,
            "create",
            parameters=parameters.model_dump(),
            **random_arguments(lambda seed: seed, seed),
            entropy=seed.entropy,
            spawn_key=seed.spawn_key,
        )

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        packed = None if mask is None else pack(mask)
        self._call("init", image, box=np.asarray(box).tolist(), mask=packed)

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        estimate = self._call("update", image)["estimate"]
        if isinstance(estimate, dict):
            if estimate.get("mask"):
                estimate["mask"] = unpack(*estimate["mask"])
            if estimate.get("revised"):
                estimate["revised"] = _revised(estimate)
        return to_estimate(estimate)

    def close(self) -> None:
        """See `ExternalPlugin.close`."""
        self._release()

    def _watch(self, image: Image) -> None:
        self._call("watch", image)

    def _finish(self) -> Mapping[int, Box]:
        return _revised(self._session.ask(self.tracker.start_seconds, "finish"))

    def _call(self, operation: str, image: Image, **arguments: Any) -> dict[str, Any]:
        limits = self.tracker
        seconds = limits.start_seconds if operation == "init" else limits.frame_seconds
        answer = self._session.ask(seconds, operation, image, **arguments)
        self.call_times = answer["wall"], answer["cpu"]
        return answer


def _revised(answer: Mapping[str, Any]) -> dict[int, Box]:
    return {frame: np.array(box) for frame, box in answer["revised"]}


def load_plugin(tracker: PythonClass) -> tuple[type[PythonPlugin], dict[str, str]]:
    """Return a plugin that runs a class in another interpreter, and versions of its libraries.

    Raises `ExternalTrackerError` if the file cannot be imported there or has no such tracker.
    """
    session = _take(tracker)
    description = session.description
    _give_back(tracker, session)
    try:
        randomness = Randomness(description["randomness"])
    except ValueError:
        raise ExternalTrackerError(
            f"{tracker.file}: the randomness is {description['randomness']!r}. Expected one of: "
            f"{', '.join(Randomness)}."
        ) from None
    keys = ("name", "paper", "presets", "default_preset")
    attributes = {key: description[key] for key in keys if key in description} | {
        "__doc__": description["doc"],
        "Parameters": create_parameters(description["parameters"]),
        "randomness": randomness,
        "tracker": tracker,
        **{name: getattr(PythonPlugin, f"_{name}") for name in description["methods"]},
    }
    return type(description["class"], (PythonPlugin,), attributes), description["libraries"]
