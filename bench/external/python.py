"""Trackers of Python files in another interpreter: the parent's side of `worker.py`."""

import json
import math
import shlex
import signal
import sys
import tempfile
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from trackmark.bench.external.plugin import (
    Definition,
    ExternalPlugin,
    digest_file,
    keep_process,
    take_process,
)
from trackmark.bench.external.process import FRAME_FOLDER, ExternalTrackerError, LineProcess
from trackmark.trackers import Box, Estimate, Image, Mask, TrackerError
from trackmark.trackers.base.call_clock import CallTime
from trackmark.trackers.base.catalogue import in_file
from trackmark.trackers.base.plain import create_plugin, seed_number

START, WORKER = (Path(__file__).with_name(name) for name in ("start.py", "worker.py"))
MARK = b"@@TRACKMARK:"
"""Start of each answer of `worker.py`."""


class PythonDefinition(Definition):
    """Table with the key `file`."""

    file: str = ""
    python: str = ""


class WorkerProcess(LineProcess):
    """Process of `worker.py`; `description` is its description of the tracker."""

    stack_signal = signal.SIGUSR1

    def __init__(self, definition: PythonDefinition) -> None:
        # The file has no name, so that nothing is left if this process is killed.
        self.frames = tempfile.TemporaryFile(dir=FRAME_FOLDER, buffering=0)  # noqa: SIM115  # closed with the process
        file, name = in_file(definition.file) or (Path(), "")
        self.source = str(file)
        self._n_requests = 0
        tracker = [str(file), *filter(None, [name])]
        super().__init__(
            [definition.python, "-u", str(START), str(WORKER), str(self.frames.fileno()), *tracker],
            name=shlex.join([definition.python, *tracker]),
            # A crash then prints the stack of Python.
            environment={"PYTHONFAULTHANDLER": "1", **definition.environment},
            files=[self.frames],
        )
        self.description = self.ask(definition.start_timeout, "describe")

    def ask(self, seconds: float, operation: str, **arguments: Any) -> dict[str, Any]:
        """Return the answer to a request; raise `ExternalTrackerError` if it fails."""
        self.is_usable = False
        self._n_requests += 1
        request = json.dumps([self._n_requests, operation, arguments], default=int)  # of NumPy
        self.send(request.encode() + b"\n", seconds)
        # A command that starts the interpreter can print lines of its own.
        answer = self._parse(self.read_line(seconds, MARK))
        if "error" in answer:
            raise self.fail(f"raised {answer['error']}")
        if "invalid" in answer:
            raise self.fail(f"returned an invalid estimate: {answer['invalid']}")
        if "unusable" in answer:
            self.close()
            raise TrackerError(answer["unusable"])
        self.is_usable = True
        return answer

    def _parse(self, line: bytes) -> dict[str, Any]:
        """Return the answer to the last request; only code of a tracker can write another line."""
        try:
            number, answer = json.loads(line.partition(MARK)[2])
            is_error = number is None and "error" in answer
            is_expected = isinstance(answer, dict) and (number == self._n_requests or is_error)
        except (ValueError, TypeError):
            is_expected = False
        if not is_expected:
            text = line.decode(errors="replace")[:80]
            raise self.fail(
                f"sent {text!r}, which is not the answer to request {self._n_requests}. Write to "
                "stdout or stderr only, not to other descriptors of the process"
            )
        return dict(answer)


class PythonPlugin(ExternalPlugin):
    """Plugin of a class in another interpreter; see `open_plugin`."""

    definition: ClassVar[PythonDefinition]
    _device = ""

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        super().__init__(parameters, seed)
        self.process: WorkerProcess = take_process(WorkerProcess, self.definition, self.digest)
        answer = self.process.ask(
            self.definition.start_timeout,
            "create",
            parameters=parameters.model_dump(),
            seed=seed_number(seed),
            entropy=seed.entropy,
            spawn_key=seed.spawn_key,
        )
        self.drawn = answer["drawn"]

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        self._last_box = np.array(box)
        image = self.convert(image)
        pixels = [image] if mask is None else [image, mask]
        self._call(self.definition.start_timeout, "init", *pixels, box=np.asarray(box).tolist())

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        converted = self.convert(image)
        fields = self._call(self.definition.frame_timeout, "update", converted)["estimate"]
        if fields["mask"]:
            shape, dtype = fields["mask"]
            self.process.frames.seek(0)
            data = self.process.frames.read(math.prod(shape) * np.dtype(dtype).itemsize)
            fields["mask"] = np.frombuffer(data, dtype).reshape(shape)
        return self.estimate(fields)

    @property
    def device(self) -> str:
        """See `SelfTimed.device`."""
        return self._device

    def close(self) -> None:
        """See `ExternalPlugin.close`."""
        process = vars(self).pop("process", None)
        if process and process.is_usable:
            keep_process(process, self.definition, self.digest)
        elif process:
            process.close()

    def _call(
        self, seconds: float, method: str, *pixels: Image | Mask, **arguments: Any
    ) -> dict[str, Any]:
        """Return the answer of a method of the tracker to an image and a mask."""
        self.process.frames.seek(0)
        for array in pixels:
            # Writing reports a full disk as an error; through a memory map, it would be a signal.
            if self.process.frames.write(np.ascontiguousarray(array).data) != array.nbytes:
                raise ExternalTrackerError("the frame cannot be written: no space left in memory.")
        types = [(array.shape, array.dtype.str) for array in pixels]
        answer = self.process.ask(seconds, method, pixels=types, **arguments)
        self.call_time, self._device = CallTime(*answer["time"]), answer["device"]
        self.drawn = answer["drawn"]
        return answer


def open_plugin(
    definition: PythonDefinition, owner: str, folder: Path
) -> tuple[type[PythonPlugin], Path]:
    """Return a plugin that runs a class in another interpreter, and the file of the class.

    Relative paths of the definition refer to `folder`; `owner` is the tracker in messages.
    """
    place = in_file(definition.file)
    if place is None:
        raise TrackerError(
            f"{owner}: file is {definition.file!r}. Expected: a Python file (.py), or instead of "
            "file the key trax with a command."
        )
    file = (folder / place[0]).resolve()
    if not file.is_file():
        raise TrackerError(f"{file}: this tracker file does not exist.")
    interpreter = find_interpreter(definition.python or sys.executable, folder)
    paths = {"file": f"{file}:{place[1]}", "python": interpreter}
    definition, digest = definition.model_copy(update=paths), digest_file(file)
    process = take_process(WorkerProcess, definition, digest)
    keep_process(process, definition, digest)
    description = process.description
    plugin = create_plugin(
        PythonPlugin,
        owner,
        description,
        definition=definition,
        digest=digest,
        version={
            "source": definition.version or f"{digest}-{description['class']}",
            "libraries": description["libraries"],
        },
    )
    return plugin, file


def find_interpreter(python: str, folder: Path) -> str:
    """Return the path of an interpreter; a name without `/` is looked up in PATH.

    A folder is an environment of `venv` or conda. Links are kept, because they select it.
    """
    if "/" not in python and not (folder / python).is_dir():
        return python
    path = (folder / Path(python).expanduser()).absolute()
    return str(path / "bin" / "python" if path.is_dir() else path)
