"""Protocols: start frames of a tracker, repetitions, and restarts after a failure.

Each file of this folder defines one protocol. Its docstring is the definition with its source. It
exports a subclass of `Protocol`, named `PROTOCOL`, whose fields are the parameters. A protocol
divides a run into segments; a tracker is initialised for each. Its controller decides frame by
frame whether the tracker is updated, restarted or not shown the frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import GroundTruthLike
from trackmark.datasets.spec_string import close_match, format_text, parse_text
from trackmark.trackers.base.parameters import Parameters, TrackerError

ONE_PASS = "one-pass"  # noqa: S105  # not a password
"""Name of the default protocol."""

STORED_ONE_PASS = "accuracy"  # noqa: S105  # not a password
"""Stored name of one-pass runs. It dates from the time when there was no other protocol."""

TIMING = "timing"
"""Stored name of timing runs, which are one-pass runs with measured times."""

_FOLDER = Path(__file__).parent


class ProtocolError(ValueError):
    """Invalid protocol; the message names it, and the valid ones."""


@dataclass(frozen=True)
class Segment:
    """Part of a run for which a tracker is initialised: from a frame to an end of the sequence.

    With start 0 and step 1 it is the whole sequence. The tracker is then initialised in the first
    frame with a target.
    """

    start: int = 0
    step: int = 1  # -1: backwards to the first frame
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
    """Action on a tracker at a frame."""

    UPDATE = "update"
    RESTART = "initialise a new one with the ground truth"
    SKIP = "do not show the frame"


class Controller:
    """Decisions on one tracker, frame by frame after its first; this class always updates it."""

    states: NDArray[np.int32] | None = None  # (n,): a `bench.metrics.preset.FrameState` per frame
    source_frames: NDArray[np.int32] | None = None  # (n,): frame on which each estimate was made

    def action(self, frame: int) -> Action:
        """Return the action at a frame; called once per frame, in order."""
        return Action.UPDATE

    def on_estimate(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """Receive an estimate; return the reason if the run fails because of it, otherwise "".

        `row`: x, y, width, height [px], visible (1 or 0), confidence (NaN if missing). `seconds`:
        time of the update.
        """
        return ""


class Protocol(Parameters):
    """Base class of protocols. The fields are the parameters, with type, bounds and meaning."""

    judged: ClassVar[tuple[str, ...]] = ("one pass",)
    """Kinds of metrics presets that judge its runs; see `bench.metrics.preset.Preset.protocol`."""

    preset: ClassVar[str] = "native"
    """Default metrics preset of its tables."""

    segmented: ClassVar[bool] = False
    """True if runs store their frames by segment, even if there is only one."""

    by_values: ClassVar[bool] = False
    """True if the segments depend on values of the data; see `segments`."""

    @property
    def name(self) -> str:
        """Name of the file, with hyphens."""
        return type(self).__module__.rpartition(".")[2].replace("_", "-")

    @property
    def text(self) -> str:
        """Canonical text, under which runs are stored: name and parameters that are not default."""
        fields = type(self).model_fields
        return format_text(
            self.name, {key: value for key, value in self if value != fields[key].default}
        )

    @property
    def time_dependent(self) -> bool:
        """True if runs depend on the time of updates; such runs are executed one by one."""
        return False

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """Return the segments of a run; by default one, the whole sequence.

        `present`: frames with a target, shape (n,), at least one. `values`: values of the data by
        name, one per frame.
        """
        return [Segment()]

    def controller(self, truth: GroundTruthLike, first: int, size: tuple[int, int]) -> Controller:
        """Return the controller of one segment; by default the tracker is updated at every frame.

        `truth`: ground truth of the init box. `first`: frame of initialisation. `size`: width and
        height of the images [px].
        """
        return Controller()


@cache
def names() -> list[str]:
    """Return the sorted names of the protocols, which are the names of their files."""
    return sorted(file.stem.replace("_", "-") for file in _FOLDER.glob("[a-z]*.py"))


def parse_protocol(text: str) -> Protocol:
    """Return the protocol of a text `name:parameter=value:…`, or of a stored name.

    Raises `ProtocolError` for an unknown name or parameter, or an invalid value.
    """
    try:
        name, options = parse_text(text)
    except ValueError as error:
        raise ProtocolError(f"protocol {error}") from None
    name = ONE_PASS if name == STORED_ONE_PASS else name
    if name not in names():
        hint = close_match(name, names()) or f" Known: {', '.join(names())}."
        raise ProtocolError(f"unknown protocol {name!r}.{hint}")
    protocol_class: type[Protocol] = _module(name).PROTOCOL
    try:
        return protocol_class.checked(f"protocol {name}", options)
    except TrackerError as error:
        raise ProtocolError(str(error)) from None


def stored_protocol(stored: str) -> Protocol:
    """Return the protocol of stored runs; timing runs are one-pass."""
    return parse_protocol(STORED_ONE_PASS if stored == TIMING else stored)


def title(stored: str) -> str:
    """Return the title of stored runs in tables: `one-pass`, or the text of their protocol."""
    return ONE_PASS if stored == STORED_ONE_PASS else stored


def definition(name: str) -> dict[str, Any]:
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
        "preset": protocol.preset,
        "judged": list(protocol.judged),
        "knobs": parameters,
    }


def _module(name: str) -> ModuleType:
    return import_module(f"trackmark.bench.protocols.{name.replace('-', '_')}")
