"""Protocols: start frames of a tracker, init boxes, and restarts after failures.

Each name of `_NAMES` is the module of one protocol: its docstring is the definition with its
source, and `PROTOCOL` is a subclass of `EvaluationProtocol`, whose fields are the parameters. A
protocol divides a run into segments; for each segment, a new tracker is initialised. The protocol's
controller decides for each frame whether the tracker is updated or restarted, or whether the frame
is skipped.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.interface import GroundTruthLike
from trackmark.datasets.spec_string import format_text, name_hint, parse_text
from trackmark.trackers.base.parameters import Parameters, TrackerError

ONE_PASS = "one-pass"  # noqa: S105  # not a password
"""Name of the default protocol."""

TIMING = "timing"
"""Protocol key of timing runs, which are one-pass runs with measured times."""

# A module is imported when its protocol is used: most commands need `one-pass` only.
_NAMES = ("anchors", "long-term", "one-pass", "real-time", "sre", "supervised", "tre")


class ProtocolError(ValueError):
    """Invalid protocol; the message names it, and the valid ones."""


@dataclass(frozen=True)
class Segment:
    """Part of a run with its own tracker: from a start frame to one end of the sequence.

    With start 0 and step 1, the segment is the whole sequence. The tracker is then initialised in
    the first frame with a target.
    """

    start: int = 0
    step: int = 1  # 1: to the last frame; -1: backwards to the first frame
    # Offset of the init box from the ground truth (x, y, width, height), in multiples of the width
    # and height of the ground-truth box.
    perturbation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def slice(self) -> slice:
        """Slice of the frames of a sequence."""
        return slice(self.start, None, self.step)

    def frames(self, n: int) -> range:
        """Return the frame numbers of the segment in a sequence of n frames."""
        return range(n)[self.slice]

    def perturbed_box(self, box: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the init box `[x, y, width, height]` for a ground-truth box."""
        width, height = box[2:]
        return np.asarray(box + np.array(self.perturbation) * (width, height, width, height))


class Action(Enum):
    """Action for a frame."""

    UPDATE = "update"
    RESTART = "initialise a new tracker with the ground truth"
    SKIP = "the tracker does not receive the frame"


class Controller:
    """Decides on each frame after the init frame; by default, the tracker is updated."""

    states: NDArray[np.int32] | None = None  # (n,): `FrameState` of each frame
    estimate_frames: NDArray[np.int32] | None = None  # (n,): frame of the estimate in each row

    def action(self, frame: int) -> Action:
        """Return the action for a frame; called once per frame, in order."""
        return Action.UPDATE

    def check_estimate(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """Process an estimate; return the reason if the run has failed, otherwise an empty text.

        `row`: x, y, width, height [px], visible (1 or 0), confidence (NaN if missing). `seconds`:
        time of the update.
        """
        return ""


class EvaluationProtocol(Parameters):
    """Base class of protocols; a subclass declares the parameters as fields."""

    run_kinds: ClassVar[tuple[str, ...]] = ("one-pass",)
    """Kinds of runs as which metrics can score the runs; see `bench.metrics.interface.RunKind`."""

    metrics: ClassVar[str] = "native"
    """Default metrics of the tables of such runs."""

    has_segments: ClassVar[bool] = False
    """True if runs store their frames by segment, even if there is only one."""

    @property
    def name(self) -> str:
        """Name of the protocol's file, with hyphens."""
        return type(self).__module__.rpartition(".")[2].replace("_", "-")

    @property
    def key(self) -> str:
        """Key of the protocol in `runs.db`: its name, and parameters that are not defaults."""
        fields = type(self).model_fields
        return format_text(
            self.name, {name: value for name, value in self if value != fields[name].default}
        )

    @property
    def time_dependent(self) -> bool:
        """True if runs depend on the time of updates; such runs are executed one by one."""
        return False

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """Return the segments of a run; by default one, the whole sequence.

        `present` (n,) is true for frames with a target, of which there is at least one. `values`
        holds further per-frame values of the sequence, by name.
        """
        return [Segment()]

    def controller(self, truth: GroundTruthLike, first: int, size: tuple[int, int]) -> Controller:
        """Return the controller of a segment; by default, the tracker is updated in every frame.

        `truth` is the ground truth that initialises the run. `first` is the frame of the
        initialisation. `size` is the width and height of the images [px].
        """
        return Controller()


def names() -> list[str]:
    """Return the sorted names of the protocols."""
    return list(_NAMES)


def parse_protocol(spec: str) -> EvaluationProtocol:
    """Return the protocol from its text `name:parameter=value:…`.

    Raises `ProtocolError` for an unknown name or parameter, or an invalid value. Raises `TypeError`
    unless the argument is a text.
    """
    if not isinstance(spec, str):
        raise TypeError(f"protocol is {spec!r}. Expected: a text, for example {ONE_PASS!r}.")
    try:
        name, options = parse_text(spec)
    except ValueError as error:
        raise ProtocolError(f"protocol {error}") from None
    if name not in _NAMES:
        hint = name_hint(name, names())
        raise ProtocolError(f"unknown protocol {name!r}.{hint}")
    protocol_class: type[EvaluationProtocol] = _module(name).PROTOCOL
    try:
        return protocol_class.checked(f"protocol {name}", options)
    except TrackerError as error:
        raise ProtocolError(str(error)) from None


def protocol_of_key(protocol_key: str) -> EvaluationProtocol:
    """Return the protocol of runs with this key; for timing runs, the one-pass protocol."""
    return parse_protocol(ONE_PASS if protocol_key == TIMING else protocol_key)


def describe_protocol(name: str) -> dict[str, Any]:
    """Return the description of a protocol, as `trackmark describe --json` prints it."""
    protocol = parse_protocol(name)
    summary, _, rest = (_module(protocol.name).__doc__ or "").strip().partition("\n\n")
    parameters = [
        {"name": key, "default": field.default, "meaning": field.description}
        for key, field in type(protocol).model_fields.items()
    ]
    return {
        "name": protocol.name,
        "summary": summary,
        "definition": rest,
        "metrics": protocol.metrics,
        "run_kinds": list(protocol.run_kinds),
        "parameters": parameters,
    }


def _module(name: str) -> ModuleType:
    return import_module(f"trackmark.bench.protocols.{name.replace('-', '_')}")
