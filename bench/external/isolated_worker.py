"""Operations of `worker.py` on trackers of the full interface, in the interpreter of trackmark.

| operation and arguments | answer |
|---|---|
| catalogue: name | description of the tracker, as by `trackers.describe` |
| describe: name, options | fields of `Specification` |
| create: name, options, entropy, spawn_key | time, device, drawn, methods |
| watch: pixels | drawn |
| init: pixels, box | time, device, drawn |
| update: pixels, keeps_arrays | time, device, drawn, estimate, arrays, revised |
| maps: pixels | arrays |
| finish | drawn, revised |
| drop | |

`methods` are the optional methods that the tracker has. `arrays` has shapes and types by name; the
arrays are in the file of frames, after the mask. `revised` is a list of frames with their boxes.
"""

import traceback
from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark import trackers
from trackmark.bench.external.process import exception_text
from trackmark.bench.external.worker import Operations, write_arrays
from trackmark.bench.operating_system import machine_fault
from trackmark.trackers import Estimate, TrackerError
from trackmark.trackers.base import call_clock
from trackmark.trackers.base.estimate_check import MalformedEstimateError
from trackmark.trackers.base.global_generators import GlobalGenerators
from trackmark.trackers.base.plain import PlainTracker, read_answer, seed_number

OPTIONAL_METHODS = ("watch", "finish", "maps")


class IsolatedTrackers(Operations):
    """Operations on trackers of the full interface; see `Operations`."""

    def __init__(self, frames: Any) -> None:
        super().__init__(frames, call_clock)
        self._generators = GlobalGenerators(0)
        cv2.setNumThreads(1)  # as in a worker: several processes share the cores

    def perform(self, operation: str, **arguments: Any) -> Any:
        """Return the answer of an operation.

        Estimates that are no valid values, and exceptions of trackers, are answers, too.
        """
        is_call = operation not in ("catalogue", "describe")
        try:
            return super().perform(operation, **arguments)
        except MalformedEstimateError as error:
            return {"invalid": str(error), "drawn": self._generators.drawn}
        except BaseException as error:  # noqa: BLE001  # code of a tracker can raise anything
            reason = exception_text(error)
            if is_call:
                return {
                    "raised": reason,
                    "trace": "".join(traceback.format_exception(error)),
                    "fault": str(machine_fault(error) or ""),
                    "drawn": self._generators.drawn,
                }
            if not isinstance(error, TrackerError):
                reason = f"{arguments['name']}: its description raises {reason}"
            return {"unusable": reason}

    def catalogue(self, name: str) -> dict[str, Any]:
        """Return the description of a tracker."""
        return trackers.describe(name)

    def describe(self, name: str, options: Mapping[str, str]) -> dict[str, Any]:
        """Return the values that a specification selects."""
        selected = trackers.resolve(name, **options)
        return {
            "name": selected.name,
            "parameters": selected.parameters.model_dump(),
            "options": dict(selected.options),
            "randomness": str(selected.randomness),
            "class_name": selected.plugin.__name__,
            "file": str(selected.file),
        }

    def create(
        self, name: str, options: Mapping[str, str], entropy: int, spawn_key: Sequence[int]
    ) -> dict[str, Any]:
        """Create a tracker."""
        seed = np.random.SeedSequence(entropy, spawn_key=tuple(spawn_key))
        self._generators = GlobalGenerators(seed_number(seed))
        specification = trackers.resolve(name, **options)
        with self._generators:
            self._tracker = specification.create(seed)
        methods = [name for name in OPTIONAL_METHODS if hasattr(self._tracker, name)]
        return {"methods": methods, "drawn": self._generators.drawn}

    def watch(self, pixels: Any) -> dict[str, Any]:
        """Show a frame without the target to the tracker."""
        with self._generators:
            self._tracker.watch(*self._read(pixels))
        return {"drawn": self._generators.drawn}

    def init(self, pixels: Any, box: Sequence[float]) -> dict[str, Any]:
        """Initialise the tracker."""
        image, mask = self._read([*pixels, None])[:2]
        called, init = self._tracker, self._tracker.init
        if isinstance(called, PlainTracker):
            image, called, init = called.convert(image), called.plain, called.plain_init
        return self._call(called, init, image, np.array(box, np.float64), mask)[1]

    def update(self, pixels: Any, keeps_arrays: bool) -> dict[str, Any]:
        """Return the estimate of the tracker."""
        (image,) = self._read(pixels)
        called, shape = self._tracker, image.shape
        if isinstance(called, PlainTracker):
            image, called = called.convert(image), called.plain
        estimate, reply = self._call(called, called.update, image)
        fields = read_answer(self._tracker, estimate, shape)
        arrays = {} if fields["mask"] is None else {"mask": fields.pop("mask")}
        if isinstance(estimate, Estimate):
            if estimate.revised:
                reply["revised"] = list(estimate.revised.items())
            if keeps_arrays:
                named = estimate.arrays.items()
                arrays |= {f"arrays.{key}": np.array(value) for key, value in named}
        return reply | {"estimate": fields | {"mask": None}} | self._write(arrays)

    def maps(self, pixels: Any) -> dict[str, Any]:
        """Return the weight maps of the frame that was just passed to `update`."""
        with self._generators:
            maps = dict(self._tracker.maps(*self._read(pixels)))
        self.copies.end()  # before it writes to the file of frames
        return self._write(maps)

    def finish(self) -> dict[str, Any]:
        """Return the corrected boxes of the tracker at the end of the sequence."""
        with self._generators:
            revised = list(self._tracker.finish().items())
        return {"revised": revised, "drawn": self._generators.drawn}

    def _write(self, arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        for name, array in arrays.items():
            if np.asarray(array).dtype.kind in "OV":
                raise MalformedEstimateError(
                    f"the array {name!r} is of type {np.asarray(array).dtype}. Expected: numbers"
                )
        values = [np.asarray(array) for array in arrays.values()]
        types = write_arrays(self._frames, values) if values else []
        return {"arrays": dict(zip(arrays, types, strict=True))}
