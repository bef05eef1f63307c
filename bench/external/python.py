"""Trackers of Python files in another interpreter; `worker.py` runs them there."""

import sys
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from trackmark.bench.external import keep_process, take_process
from trackmark.bench.external.plugin import ExternalOptions, ExternalPlugin, digest_file
from trackmark.bench.external.worker_process import WorkerProcess
from trackmark.trackers import Box, Estimate, Image, Mask, TrackerError
from trackmark.trackers.base.catalogue import in_file
from trackmark.trackers.base.plain import create_plugin, seed_number


class PythonOptions(ExternalOptions):
    """Table with the key `file`."""

    file: str = ""
    python: str = ""


class PlainProcess(WorkerProcess):
    """Process of a class in another interpreter; `description` is that of the class."""

    def __init__(self, options: PythonOptions) -> None:
        file, name = in_file(options.file) or (Path(), "")
        super().__init__(
            "",
            [str(file), *filter(None, [name])],
            python=options.python,
            source=str(file),
            environment=options.environment,
        )
        self.description = self.ask(options.start_limit, "describe")


class PythonPlugin(ExternalPlugin):
    """Plugin of a class in another interpreter; see `open_python_plugin`."""

    external_options: ClassVar[PythonOptions]
    process: PlainProcess

    def __init__(self, parameters: Any, seed: np.random.SeedSequence) -> None:
        super().__init__(parameters, seed)
        self.process = _take(self.external_options, self.digest)
        self.process.call(
            self,
            self.external_options.start_limit,
            "create",
            parameters=parameters.model_dump(),
            seed=seed_number(seed),
            entropy=seed.entropy,
            spawn_key=seed.spawn_key,
        )

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        self._last_box = np.array(box)
        image = self.convert(image)
        arrays = [image] if mask is None else [image, mask]
        start_limit = self.external_options.start_limit
        self.process.call(self, start_limit, "init", arrays, box=np.asarray(box).tolist())

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        frame_limit = self.external_options.frame_limit
        reply = self.process.call(self, frame_limit, "update", [self.convert(image)])
        fields = reply["estimate"]
        if fields["mask"]:
            (fields["mask"],) = self.process.read_arrays([fields["mask"]])
        return self.estimate(fields)

    def close(self) -> None:
        """See `ExternalPlugin.close`."""
        if process := vars(self).pop("process", None):
            limit = self.external_options.frame_limit
            process.drop_tracker(limit, self.external_options, self.digest)


def _take(options: PythonOptions, digest: str) -> PlainProcess:
    return take_process(lambda: PlainProcess(options), options, digest)


def open_python_plugin(
    options: PythonOptions, owner: str, folder: Path
) -> tuple[type[PythonPlugin], Path]:
    """Return a plugin that runs a class in another interpreter, and the file of the class.

    Relative paths of the options refer to `folder`; `owner` is the tracker in messages.
    """
    file_and_class = in_file(options.file)
    if file_and_class is None:
        raise TrackerError(
            f"{owner}: file is {options.file!r}. Expected: a Python file (.py), or instead of "
            "file the key trax with a command."
        )
    file = (folder / file_and_class[0]).resolve()
    if not file.is_file():
        raise TrackerError(f"{file}: this tracker file does not exist.")
    interpreter = find_interpreter(options.python or sys.executable, folder)
    paths = {"file": f"{file}:{file_and_class[1]}", "python": interpreter}
    options, digest = options.model_copy(update=paths), digest_file(file)
    process = _take(options, digest)
    keep_process(process, options, digest)
    description = process.description
    plugin = create_plugin(
        PythonPlugin,
        owner,
        description,
        external_options=options,
        digest=digest,
        version={
            "source": options.version or f"{digest}-{description['class']}",
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
