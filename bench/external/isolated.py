"""Trackers of the full interface in processes of their own, with the interpreter of trackmark.

A tracker from outside the package runs in this way, because its code can end or damage its
process. So does a tracker of the package that uses the random generators of the whole process.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trackmark.bench.external import FRAME_SECONDS, keep_process, take_process
from trackmark.bench.external.plugin import RemoteTracker, digest_file
from trackmark.bench.external.process import ExternalTrackerError
from trackmark.bench.external.worker_process import WorkerProcess
from trackmark.trackers import Box, Estimate, Image, Mask, TrackerError
from trackmark.trackers.base.catalogue import in_file

_OPERATIONS = "trackmark.bench.external.isolated_worker:IsolatedTrackers"

START_SECONDS = 300.0
"""Time limit of the start of a process and of the import of a tracker [s]."""


@dataclass(frozen=True)
class IsolatedFactory:
    """Factory of trackers that run in a process of their own.

    `name` and `options` are the parts of a specification, `digest` is that of the tracker's file.
    `frame_seconds` is the time limit of each call of the tracker.
    """

    name: str
    options: Mapping[str, Any]
    digest: str = ""
    frame_seconds: float = FRAME_SECONDS

    def __call__(self, seed: np.random.SeedSequence) -> "IsolatedTracker":
        """Create the tracker."""
        return IsolatedTracker(self, seed)

    @property
    def process_key(self) -> tuple[str, str]:
        """Key of the processes that can run the tracker: they have run no other tracker."""
        return self.name, self.digest

    def start_process(self) -> WorkerProcess:
        """Start a process; it imports the tracker on its first use."""
        place = in_file(self.name)
        source = str(place[0].absolute()) if place else ""
        return WorkerProcess(_OPERATIONS, source=source, name=self.name)


def open_isolated(name: str, options: Mapping[str, Any]) -> tuple[IsolatedFactory, dict[str, Any]]:
    """Return the factory of a tracker, and the values that its specification selects.

    The process of the tracker imports its file. The values are those of
    `isolated_worker.IsolatedTrackers.describe`.

    Raises `TrackerError` for an invalid tracker, or if the import fails.
    """
    file_and_class, digest = in_file(name), ""
    if file_and_class is not None:
        if not file_and_class[0].is_file():
            raise TrackerError(f"{file_and_class[0]}: this tracker file does not exist.")
        digest = digest_file(file_and_class[0])
    factory = IsolatedFactory(name, options, digest)
    return factory, _ask(factory, "describe", name=name, options=options)


def describe_isolated(name: str) -> dict[str, Any]:
    """Return the description of a tracker, as `trackers.describe`; its process imports its file.

    Raises `TrackerError` for an invalid tracker, or if the import fails.
    """
    return _ask(IsolatedFactory(name, {}), "catalogue", name=name)


def _ask(factory: IsolatedFactory, operation: str, **arguments: Any) -> dict[str, Any]:
    """Return an answer about a tracker; the process is kept for the next one."""
    process = take_process(factory.start_process, *factory.process_key)
    was_idle = process.n_requests > 0
    try:
        reply = process.ask(START_SECONDS, operation, **arguments)
    except TrackerError as error:
        if was_idle:  # a run in this process can have exhausted its files or memory
            return _ask(factory, operation, **arguments)
        if not isinstance(error, ExternalTrackerError):
            raise
        reason = str(error).partition("\n")[0].removeprefix(f"{factory.name}: ")
        raise TrackerError(f"{factory.name}: the import failed: {reason}") from None
    keep_process(process, *factory.process_key)
    return reply


class IsolatedTracker(RemoteTracker):
    """Tracker in a process of its own; it gives the estimates that it gives in this process.

    The optional methods `watch`, `finish` and `maps` are attributes if the tracker has them.
    """

    process: WorkerProcess

    def __init__(self, factory: IsolatedFactory, seed: np.random.SeedSequence) -> None:
        self._factory = factory
        self.process = take_process(factory.start_process, *factory.process_key)
        methods = self.process.call(
            self,
            START_SECONDS,  # a new process imports the file
            "create",
            name=factory.name,
            options=dict(factory.options),
            entropy=seed.entropy,
            spawn_key=seed.spawn_key,
        )["methods"]
        for name in methods:
            setattr(self, name, getattr(self, f"_{name}"))

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        arrays: list[Any] = [image] if mask is None else [image, mask]
        self._call("init", arrays, box=np.asarray(box).tolist())

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        reply = self._call("update", [image], keeps_arrays=self.keeps_arrays)
        fields = reply["estimate"]
        arrays = self._arrays(reply)
        fields["mask"] = arrays.pop("mask", None)
        fields["box"] = None if fields["box"] is None else np.array(fields["box"])
        return Estimate(
            **fields,
            arrays={name.removeprefix("arrays."): array for name, array in arrays.items()},
            revised=dict(reply["revised"]) if "revised" in reply else None,
        )

    def close(self) -> None:
        """See `RemoteTracker.close`."""
        if process := vars(self).pop("process", None):
            process.drop_tracker(self._factory.frame_seconds, *self._factory.process_key)

    def _watch(self, image: Image) -> None:
        self._call("watch", [image])

    def _finish(self) -> Mapping[int, Box]:
        return dict(self._call("finish")["revised"])

    def _maps(self, image: Image) -> Mapping[str, Any]:
        return self._arrays(self._call("maps", [image]))

    def _call(
        self, operation: str, arrays: Sequence[Image | Mask] = (), **arguments: Any
    ) -> dict[str, Any]:
        seconds = self._factory.frame_seconds
        return self.process.call(self, seconds, operation, arrays, **arguments)

    def _arrays(self, reply: Mapping[str, Any]) -> dict[str, Any]:
        types: Mapping[str, Sequence[Any]] = reply["arrays"]
        return dict(zip(types, self.process.read_arrays(types.values()), strict=True))
