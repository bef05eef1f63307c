"""Measures of a run; a specification is, for example, `mean_error:first=36:last=80`.

A measure is a function of a `MeasuredRun` with the decorator `@measure`. A paper's `measures.py`
adds further measures. Functions with this decorator in its `scenes.py` are measures of scenes.
Frames are numbered as in the paper.
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from math import hypot, nan
from typing import Any, Literal, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from trackmark.bench.evaluation.run_record import Run, Trajectory
from trackmark.bench.metrics.boxes import centre_error, overlap
from trackmark.bench.store.truth import StoredTruth
from trackmark.datasets.spec_string import parse_text

Values = NDArray[np.float64]
Function = Callable[..., Any]
F = TypeVar("F", bound=Function)

KEPT_SHARE = 0.9  # minimum share of the visible frames in which a kept target is tracked
LAST_FRAMES = 10  # number of last visible frames, in all of which a kept target is tracked
MIN_VISIBLE = 0.3  # minimum visible share of the target in a visible frame
TOLERANCE = 0.5  # largest centre error of a tracked frame [mean box sides]


@dataclass(frozen=True)
class FrameRules:
    """Rules of a paper for the frames of its runs."""

    trajectory: Trajectory  # boxes that are measured
    frames_from: int  # number of the first frame in the paper
    on_target: "Callable[[MeasuredRun], Values]"  # positive in tracked frames


@dataclass(frozen=True)
class MeasuredRun:
    """Run with the ground truth of its sequence.

    A failed run is measured as if it had no estimate after the initialisation.
    """

    record: Run
    truth: StoredTruth  # boxes are those of the init region
    rules: FrameRules

    @cached_property
    def boxes(self) -> Values:
        """Online or revised boxes in pixels, shape (n, 4); NaN after init if the run failed."""
        boxes = np.array(self.record.boxes_in(self.rules.trajectory), np.float64)
        if self.record.failure:
            boxes[int(np.argmax(self.present)) + 1 :] = nan
        return boxes

    @cached_property
    def present(self) -> NDArray[np.bool_]:
        """True in frames with the target in view, shape (n,)."""
        return np.asarray(np.isfinite(self.truth.boxes).all(axis=1))

    @cached_property
    def visible(self) -> NDArray[np.bool_]:
        """True in frames in which at least `MIN_VISIBLE` of the target is visible, shape (n,)."""
        return np.asarray(self.present & ~(self.truth.visibility < MIN_VISIBLE))

    @cached_property
    def error(self) -> Values:
        """Centre error in pixels, shape (n,); the diagonal of the image if there is no estimate."""
        errors = centre_error(self.truth.boxes, self.boxes)
        return np.where(self.present & ~np.isfinite(errors), self.diagonal, errors)

    @cached_property
    def overlap(self) -> Values:
        """Overlap in [0, 1], shape (n,); NaN if the target is absent, 0 if there is no estimate."""
        estimated = self.present & np.isfinite(self.boxes).all(axis=1)
        values = np.where(self.present, 0.0, nan)
        values[estimated] = overlap(self.truth.boxes[estimated], self.boxes[estimated])
        return values

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the image; of the ground truth's extent if the image size is unknown [px]."""
        if self.truth.image_size:
            return hypot(*self.truth.image_size)
        corners = self.truth.boxes[:, :2] + self.truth.boxes[:, 2:]
        return float(np.hypot(*np.nanmax(corners, axis=0)))

    @cached_property
    def tolerance(self) -> float:
        """Largest centre error of a tracked frame, in pixels."""
        return float(TOLERANCE * np.nanmean(self.truth.boxes[:, 2:]))

    @cached_property
    def on_target(self) -> NDArray[np.bool_]:
        """True in tracked frames, by the definition of the paper, shape (n,)."""
        return np.asarray(self.rules.on_target(self), np.float64) > 0

    def detail(self, name: str) -> Values:
        """Return a detail that the tracker stored by frame, shape (n,); NaN if there is none."""
        values = self.record.details.get(name)
        return np.full(len(self.truth.boxes), nan) if values is None else np.asarray(values, float)


@dataclass(frozen=True)
class Measure:
    """Measure with its options.

    A measure of a `run` is a function of a `MeasuredRun`. A measure of a `scene` is a function of
    the specifications of a scene and of trackers.
    """

    spec: str
    subject: Literal["run", "scene"]
    function: Function
    unit: str  # such as `share`, `px` or `frames`
    lower_is_better: bool = False
    options: Mapping[str, Any] = field(default_factory=dict)
    lost_before: Function | None = None  # 1 if the target is lost before the event, else 0
    kept_measure: Function | None = None  # 1 if the target is kept; None: as the paper defines it
    averaged: bool = False  # values of a sequence with several members are averaged, not summed

    def __call__(self, measured: MeasuredRun) -> float:
        """Return the value of the measure for a run."""
        return float(self.function(measured, **self.options))

    @property
    def definition(self) -> str:
        """Definition of the measure: the first line of its docstring, and its specification."""
        first_line = str(self.function.__doc__).partition("\n")[0]
        return f"{first_line.removeprefix('Return ').rstrip('.')} (`{self.spec}`)"


_MEASURES: dict[Function, Measure] = {}


def measure(unit: str = "", **properties: Any) -> Callable[[F], F]:
    """Declare a function as a measure; the fields of `Measure` explain the arguments."""

    def declare(function: F) -> F:
        _MEASURES[function] = Measure(function.__name__, "run", function, unit, **properties)
        return function

    return declare


@cache
def find_measure(spec: str, paper: str) -> Measure:
    """Return the measure of a specification; the paper's measures precede the common ones.

    `scenes.NAME` is a measure of scenes. Raises `ValueError` for an unknown name or option.
    """
    name, options = parse_text(spec)
    is_of_scenes = name.startswith("scenes.")
    function = find_in_module(name if is_of_scenes else f"measures.{name}", paper)
    declared = _MEASURES.get(function) or _COMMON_MEASURES.get(name)
    if declared is None:
        raise ValueError(f"unknown measure {name!r} in {spec!r}")
    try:
        typed = typed_options(declared.function, options)
    except ValueError as error:
        raise ValueError(f"measure {spec!r}: {error}") from None
    return replace(declared, spec=spec, subject="scene" if is_of_scenes else "run", options=typed)


def typed_options(function: Function, options: Mapping[str, str]) -> dict[str, Any]:
    """Convert the texts of options to the types of a function's parameters.

    Raises `ValueError` for an unknown option or a text of another type.
    """
    types = get_type_hints(function)
    if unknown := [name for name in options if name not in types]:
        raise ValueError(f"no option {unknown[0]!r}")
    return {name: TypeAdapter(types[name]).validate_python(text) for name, text in options.items()}


def find_in_module(name: str, paper: str) -> Any:
    """Return `MODULE.NAME` of a paper's modules; None if it does not exist."""
    module, _, attribute = name.rpartition(".")
    path = f"trackmark.bench.papers.{paper}.{module}"
    try:
        return getattr(importlib.import_module(path), attribute, None)
    except ModuleNotFoundError as error:
        if error.name != path:
            raise
        return None


def find_function(name: str, paper: str) -> Function:
    """Return `MODULE.NAME` of a paper's modules; raise `ValueError` if it does not exist."""
    function: Function | None = find_in_module(name, paper)
    if function is None:
        raise ValueError(f"unknown function {name!r}; expected: MODULE.FUNCTION")
    return function


def frame_values(name: str, paper: str) -> Callable[[MeasuredRun], Values]:
    """Return a function for a value per frame, of the paper's `measures.py` or a common one."""
    return _COMMON_VALUES.get(name) or find_function(f"measures.{name}", paper)


def inside(measured: MeasuredRun) -> Values:
    """Return 1 if the centre of the estimate lies inside the ground-truth box, else 0."""
    centres = measured.boxes[:, :2] + measured.boxes[:, 2:] / 2
    low, size = measured.truth.boxes[:, :2], measured.truth.boxes[:, 2:]
    return np.asarray(((centres >= low) & (centres <= low + size)).all(axis=1), np.float64)


_COMMON_VALUES: dict[str, Callable[[MeasuredRun], Values]] = {
    "error": lambda measured: measured.error,
    "within": lambda measured: np.asarray(measured.error <= measured.tolerance, np.float64),
    "inside": inside,
}


def parse_frames(ranges: str) -> list[int]:
    """Parse frames such as `11+16`, `12-15` or `1+12-15`; ranges include both ends."""
    frames: list[int] = []
    for interval in filter(None, ranges.split("+")):
        first, _, last = interval.partition("-")
        frames += range(int(first), int(last or first) + 1)
    return frames


def _tracked_at(measured: MeasuredRun, frames: list[int]) -> NDArray[np.bool_]:
    return measured.on_target[[frame - measured.rules.frames_from for frame in frames]]


@measure("share")
def kept_to_end(measured: MeasuredRun) -> float:
    """Return 1 if the target is tracked in 90 % of the visible frames and in the last ten."""
    tracked = measured.on_target[measured.visible]
    return float(tracked.mean() >= KEPT_SHARE and bool(tracked[-LAST_FRAMES:].all()))


@measure("share")
def on_target(measured: MeasuredRun) -> float:
    """Return the share of the visible frames in which the target is tracked."""
    return float(measured.on_target[measured.visible].mean())


@measure("frames")
def frames_on_target(measured: MeasuredRun) -> float:
    """Return the number of frames in which the target is tracked."""
    return float(measured.on_target.sum())


@measure("px", lower_is_better=True)
def mean_error(measured: MeasuredRun, first: int | None = None, last: int | None = None) -> float:
    """Return the mean centre error in pixels, from frame `first` to `last`, both included."""
    start = measured.rules.frames_from
    window = slice(first and first - start, last and last - start + 1)
    return float(np.nanmean(measured.error[window]))


@measure("overlap")
def mean_overlap(measured: MeasuredRun) -> float:
    """Return the mean overlap in [0, 1]."""
    return float(np.nanmean(measured.overlap))


def _lost_before_event(
    measured: MeasuredRun, tracked: str = "", lost: str = "", once_lost: str = ""
) -> float:
    event = min(parse_frames(lost) + parse_frames(once_lost), default=0)
    before = [frame for frame in parse_frames(tracked) if frame < event]
    return float(not _tracked_at(measured, before).all())


@measure("share", lost_before=_lost_before_event)
def pattern(measured: MeasuredRun, tracked: str = "", lost: str = "", once_lost: str = "") -> float:
    """Return 1 if the target is tracked and lost in the frames of the options, else 0.

    `tracked=11+16`: tracked in all of these frames. `lost=58+100`: tracked in none of them.
    `once_lost=12-15`: not tracked in at least one of them.
    """
    holds = _tracked_at(measured, parse_frames(tracked)).all()
    holds &= not _tracked_at(measured, parse_frames(lost)).any()
    if once_lost:
        holds &= not _tracked_at(measured, parse_frames(once_lost)).all()
    return float(holds)


_COMMON_MEASURES = {
    declared.spec: declared
    for function, declared in _MEASURES.items()
    if function.__module__ == __name__
}
