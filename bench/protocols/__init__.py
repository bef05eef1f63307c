"""How a tracker is run on a sequence: from where, how often, and what follows a failure.

A protocol is a file here, found by its name. Its docstring says what is done and whose it is, and
it exports one subclass of `Protocol`, as `PROTOCOL`, whose fields are its knobs. It asks for
segments, stretches of a run for each of which a tracker is begun, and it may conduct a run: say
frame by frame whether the tracker is asked, begun again or passed over. The loop does what it
says.
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

from trackmark.bench.metrics.native import Truth
from trackmark.datasets.spec_string import close_match, format_text, parse_text
from trackmark.trackers.base.parameters import Parameters, TrackerError

__all__ = [
    "ONCE",
    "STORED_ONCE",
    "TIMING",
    "Conduct",
    "Protocol",
    "ProtocolError",
    "Segment",
    "Step",
    "definition",
    "names",
    "protocol",
    "stored_protocol",
    "title",
]

ONCE = "one-pass"
"""Name of the protocol by which trackers are run unless told otherwise."""

STORED_ONCE = "accuracy"
"""What its runs are filed under, from the time when there was no other."""

TIMING = "timing"
"""What timing runs are filed under: one pass, clocked."""

_FOLDER = Path(__file__).parent


class ProtocolError(ValueError):
    """A protocol that can't be; the message says which, and what is known."""


@dataclass(frozen=True)
class Segment:
    """A stretch of a run: a tracker is begun at its start, and goes on to an end of the sequence.

    Attributes
    ----------
    start : int
        Its first frame; 0 is the whole sequence, where the tracker is begun with the first frame
        that has a target.
    step : int
        1, or -1 for a tracker that goes backwards.
    moved : tuple of float
        How the given box differs from the truth's: where its corner is moved to, right and down,
        and how much wider and higher it is, all in widths and heights of the truth's.
    """

    start: int = 0
    step: int = 1
    moved: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def slice(self) -> slice:
        """Of a sequence's frames."""
        return slice(self.start, None, self.step)

    def frames(self, n: int) -> range:
        """Numbers of its frames in a sequence of n."""
        return range(n)[self.slice]

    def given(self, box: NDArray[np.float64]) -> NDArray[np.float64]:
        """The box `[x, y, width, height]` that the tracker is given where the truth's is `box`."""
        width, height = box[2:]
        given: NDArray[np.float64] = box + np.array(self.moved) * (width, height, width, height)
        return given


class Step(Enum):
    """What is done with a tracker at a frame."""

    ASK = "it is shown the frame and answers"
    BEGIN = "a new one is begun with the truth"
    SKIP = "it is not shown the frame"


class Conduct:
    """What is done with one tracker, frame by frame after its first; this one always asks.

    Attributes
    ----------
    states : ndarray of int32, shape (n,), or None
        A `bench.metrics.preset.State` a frame, where the conduct tells frames apart.
    answered : ndarray of int32, shape (n,), or None
        Frame whose answer stands in a frame's row, where that may be another one.
    """

    states: NDArray[np.int32] | None = None
    answered: NDArray[np.int32] | None = None

    def step(self, frame: int) -> Step:
        """What is done at a frame; asked once a frame, in order."""
        return Step.ASK

    def told(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """Take notice of an answer; gives why the run fails with it, empty where it goes on.

        `row`: x, y, width, height [pixels], visible (1 or 0), confidence (NaN where it gave none).
        `seconds`: what the tracker took.
        """
        return ""


class Protocol(Parameters):
    """Base of every protocol. Its fields are the knobs, with type, bounds and meaning.

    Its text is what runs are filed under: the name, and the knobs that differ from their defaults.
    """

    judged: ClassVar[tuple[str, ...]] = ("one pass",)
    """By which presets: the kinds that `bench.metrics.preset.Preset.protocol` says."""

    preset: ClassVar[str] = "native"
    """Metrics preset of its tables where none is asked for."""

    segmented: ClassVar[bool] = False
    """True if runs store their frames by segment, even if there is only one."""

    by_values: ClassVar[bool] = False
    """Whether its segments depend on numbers that the data bring, see `segments`."""

    @property
    def name(self) -> str:
        """Its file's, with hyphens."""
        return type(self).__module__.rpartition(".")[2].replace("_", "-")

    @property
    def text(self) -> str:
        """Canonical text form, as runs are filed under."""
        fields = type(self).model_fields
        return format_text(
            self.name, {key: value for key, value in self if value != fields[key].default}
        )

    @property
    def clocked(self) -> bool:
        """Whether runs depend on how long trackers take, so that nothing else may run beside."""
        return False

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """Return the segments of a run; by default one, the whole sequence.

        `present`: where there is a target, shape (n,), somewhere at least. `values`: numbers that
        the data bring, by name and frame.
        """
        return [Segment()]

    def conduct(self, truth: Truth, first: int, size: tuple[int, int]) -> Conduct:
        """Return the conduct of one segment; by default the tracker is asked at every frame.

        `truth`: that the run starts from. `first`: frame of initialisation. `size`: width and
        height of the images [pixels].
        """
        return Conduct()


@cache
def names() -> list[str]:
    """Names of the protocols, sorted: a file each, found by its name."""
    return sorted(file.stem.replace("_", "-") for file in _FOLDER.glob("[a-z]*.py"))


def protocol(text: str) -> Protocol:
    """The protocol of a text form `name:knob=value:…`; what one-pass runs are filed under, too.

    Raises `ProtocolError` for an unknown name or knob, or a value that can't be.
    """
    try:
        name, options = parse_text(text)
    except ValueError as error:
        raise ProtocolError(f"protocol {error}") from None
    name = ONCE if name == STORED_ONCE else name
    if name not in names():
        hint = close_match(name, names())
        raise ProtocolError(f"unknown protocol {name!r}.{hint} Known: {', '.join(names())}.")
    made: type[Protocol] = _module(name).PROTOCOL
    try:
        return made.checked(f"protocol {name}", options)
    except TrackerError as error:
        raise ProtocolError(str(error)) from None


def stored_protocol(stored: str) -> Protocol:
    """Return the protocol that stored runs were made by; timing runs are one-pass."""
    return protocol(STORED_ONCE if stored == TIMING else stored)


def title(stored: str) -> str:
    """What tables call the runs that are filed under a text: `one-pass`, or the text itself."""
    return ONCE if stored == STORED_ONCE else stored


def definition(name: str) -> dict[str, Any]:
    """A protocol's `name`, `summary`, `definition`, `preset` and `knobs`, for people."""
    one = protocol(name)
    summary, _, rest = (_module(one.name).__doc__ or "").strip().partition("\n\n")
    knobs = [
        {"name": key, "default": field.default, "meaning": field.description}
        for key, field in type(one).model_fields.items()
    ]
    told = {"name": one.name, "summary": summary, "definition": rest, "preset": one.preset}
    return {**told, "judged": list(one.judged), "knobs": knobs}


def _module(name: str) -> ModuleType:
    return import_module(f"trackmark.bench.protocols.{name.replace('-', '_')}")
