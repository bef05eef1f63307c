"""Measures of a run, in text form: `mean_error:first=36:last=80`.

A measure is a function of a `JudgedRun` with a `@measure` line. Those here serve every paper; a
paper's `measures.py` adds its own. Frames are numbered as in the paper.
"""

import importlib
import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import hypot, nan
from types import ModuleType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.metrics.centre_error import centre_error
from trackmark.bench.metrics.overlap import overlap
from trackmark.bench.papers.description import Description
from trackmark.bench.store.truth import StoredTruth
from trackmark.datasets.spec_string import parse_text

Values = NDArray[np.float64]
Function = Callable[..., float]
F = TypeVar("F", bound=Callable[..., Any])

KEPT_SHARE = 0.9  # of the visible frames in which a tracked target is on the estimate
LAST_FRAMES = 10  # visible frames at the end, in all of which it is
MIN_VISIBLE = 0.3  # share of the target that is seen in a visible frame
TOLERANCE = 0.5  # mean box sides


@dataclass(frozen=True)
class JudgedRun:
    """A run with the ground truth of its sequence, frame by frame.

    A failed run counts as one that gives no box after initialisation.
    """

    run: Run
    truth: StoredTruth  # ground truth that the run was made with
    description: Description  # of the paper
    tracker: str  # text form

    @cached_property
    def boxes(self) -> Values:
        """Boxes of the paper's trace in pixels, shape (n, 4); NaN after a failed run's first."""
        boxes = np.array(self.run.boxes_in(self.description.trace), np.float64)
        if self.run.failure:
            boxes[int(np.argmax(self.present)) + 1 :] = nan
        return boxes

    @cached_property
    def present(self) -> NDArray[np.bool_]:
        """Frames with the target in view, shape (n,)."""
        return np.asarray(np.isfinite(self.truth.boxes).all(axis=1))

    @cached_property
    def visible(self) -> NDArray[np.bool_]:
        """Frames in which at least `MIN_VISIBLE` of the target is seen, shape (n,)."""
        return np.asarray(self.present & ~(self.truth.visibility < MIN_VISIBLE))

    @cached_property
    def error(self) -> Values:
        """Centre error in pixels, shape (n,); the diagonal of the image without an estimate."""
        errors = centre_error(self.truth.boxes, self.boxes)
        return np.where(self.present & ~np.isfinite(errors), self.diagonal, errors)

    @cached_property
    def overlap(self) -> Values:
        """Overlap in [0, 1], shape (n,); NaN where the target is absent, 0 without an estimate."""
        estimated = self.present & np.isfinite(self.boxes).all(axis=1)
        values = np.where(self.present, 0.0, nan)
        values[estimated] = overlap(self.truth.boxes[estimated], self.boxes[estimated])
        return values

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the image in pixels; without a known size, of the ground truth's extent."""
        if self.truth.image_size:
            return hypot(*self.truth.image_size)
        corners = self.truth.boxes[:, :2] + self.truth.boxes[:, 2:]
        return float(np.hypot(*np.nanmax(corners, axis=0)))

    @cached_property
    def tolerance(self) -> float:
        """Largest centre error that is within the tolerance, in pixels."""
        return float(TOLERANCE * np.nanmean(self.truth.boxes[:, 2:]))

    @cached_property
    def on_target(self) -> NDArray[np.bool_]:
        """Frames in which the target is tracked, as the paper's `on_target` says, shape (n,)."""
        name = self.description.on_target
        return np.asarray(series(name, self.description.name)(self), np.float64) > 0

    def in_trace(self, trace: str) -> "JudgedRun":
        """Return the run with its `online` or `revised` boxes; if `trace` is empty, as it is."""
        if not trace:
            return self
        return replace(self, description=self.description.model_copy(update={"trace": trace}))

    def detail(self, name: str) -> Values:
        """Return a number of the tracker by frame, shape (n,); NaN if it has none of this name."""
        values = self.run.details.get(name)
        return np.full(len(self.truth.boxes), nan) if values is None else np.asarray(values, float)

    def window(self, first: int | None, last: int | None) -> slice:
        """Frames from `first` to `last`, both included, as the paper numbers them."""
        start = self.description.frames_from
        stop = len(self.truth.boxes) if last is None else last - start + 1
        return slice(0 if first is None else first - start, stop)


@dataclass(frozen=True)
class Measure:
    """A measure with its options."""

    function: Function  # returns the number of a `JudgedRun`
    text: str  # text form
    unit: str  # `share`, `px`, `frames` or another
    lower_is_better: bool
    lost_before: Function | None  # returns 1 if the target is lost before the event, else 0

    def __call__(self, judged: JudgedRun) -> float:
        """Return the number of a run."""
        return float(self.function(judged))


def measure(
    unit: str = "", *, lower_is_better: bool = False, lost_before: Function | None = None
) -> Callable[[F], F]:
    """Mark a function as a measure, with its unit and direction."""

    def marked(function: F) -> F:
        vars(function)["declared"] = (unit, lower_is_better, lost_before)
        return function

    return marked


def paper_module(paper: str, name: str) -> ModuleType | None:
    """Return a module of a paper's own, or None if it has none of this name."""
    try:
        return importlib.import_module(f"trackmark.bench.papers.{paper}.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"trackmark.bench.papers.{paper}.{name}":
            raise
        return None


@cache
def find_measure(text: str, paper: str) -> Measure:
    """Return the measure of a text form, the paper's own before the common ones.

    Raises
    ------
    ExperimentError
        For an unknown name or option.
    """
    name, options = parse_text(text)
    function = getattr(paper_module(paper, "measures"), name, None) or globals().get(name)
    declared = getattr(function, "declared", None)
    if function is None or declared is None:
        raise ExperimentError(f"bench/papers/{paper}: there is no measure {name!r} ({text!r}).")
    unit, lower_is_better, lost_before = declared
    parameters = inspect.signature(function).parameters
    if unknown := [key for key in options if key not in parameters]:
        raise ExperimentError(
            f"bench/papers/{paper}: measure {name!r} has no option {unknown[0]!r} ({text!r})."
        )
    typed = {key: typed_option(value, parameters[key].annotation) for key, value in options.items()}

    def with_options(chosen: Function) -> Function:
        return lambda judged: chosen(judged, **typed)

    before = with_options(lost_before) if lost_before else None
    return Measure(with_options(function), text, unit, lower_is_better, before)


def find_function(name: str, paper: str) -> Any:
    """Return a function of a paper's own modules, named as `module.function`.

    Raises
    ------
    ExperimentError
        If there is none.
    """
    module, _, function = name.rpartition(".")
    attribute = getattr(paper_module(paper, module), function, None)
    if attribute is None:
        raise ExperimentError(f"bench/papers/{paper}: there is no function {name!r}.")
    return attribute


def check_measure(text: str, paper: str) -> None:
    """Raise `ExperimentError` if a claim's measure does not exist or has no such option."""
    name = text.partition(":")[0]
    if "." in name:
        find_function(name, paper)
    else:
        find_measure(text, paper)


def typed_option(value: str, annotation: Any) -> Any:
    """Return an option of a text form as the type that a parameter is annotated with."""
    if annotation in (bool, "bool"):
        return value == "true"
    if annotation in (float, "float"):
        return float(value)
    return int(value) if "int" in str(annotation) else value


def series(name: str, paper: str) -> Callable[[JudgedRun], Values]:
    """Return a series by frame: the paper's own, a common one, or a number of the tracker."""
    paper_series = getattr(paper_module(paper, "measures"), "SERIES", {})
    return paper_series.get(name) or SERIES.get(name) or (lambda judged: judged.detail(name))


def _within(judged: JudgedRun) -> Values:
    return np.asarray(judged.error <= judged.tolerance, np.float64)


def _inside(judged: JudgedRun) -> Values:
    """Return 1 if the centre of the estimate lies inside the ground-truth box, else 0."""
    centres = judged.boxes[:, :2] + judged.boxes[:, 2:] / 2
    low, size = judged.truth.boxes[:, :2], judged.truth.boxes[:, 2:]
    return np.asarray(((centres >= low) & (centres <= low + size)).all(axis=1), np.float64)


SERIES: dict[str, Callable[[JudgedRun], Values]] = {
    "error": lambda judged: judged.error,
    "overlap": lambda judged: judged.overlap,
    "within": _within,
    "inside": _inside,
    "visible": lambda judged: np.asarray(judged.truth.visibility, np.float64),
}


def parse_frames(text: str) -> list[int]:
    """Parse a list of frames as `11+16`, `12-15` or `1+12-15`; ranges include both ends."""
    frames: list[int] = []
    for part in filter(None, text.split("+")):
        first, _, last = part.partition("-")
        frames += range(int(first), int(last or first) + 1)
    return frames


def _on_at(judged: JudgedRun, frames: list[int]) -> NDArray[np.bool_]:
    return judged.on_target[[frame - judged.description.frames_from for frame in frames]]


@measure("share")
def kept(judged: JudgedRun) -> float:
    """Return 1 if the target is tracked in 90 % of the visible frames and in the last ten."""
    on = judged.on_target[judged.visible]
    return float(on.mean() >= KEPT_SHARE and bool(on[-LAST_FRAMES:].all()))


@measure("share")
def on_target(judged: JudgedRun, first: int | None = None, last: int | None = None) -> float:
    """Return the share of the visible frames in which the target is tracked."""
    window = judged.window(first, last)
    return float(judged.on_target[window][judged.visible[window]].mean())


@measure("frames")
def frames_on_target(judged: JudgedRun) -> float:
    """Return the number of frames in which the target is tracked."""
    return float(judged.on_target.sum())


@measure("px", lower_is_better=True)
def mean_error(judged: JudgedRun, first: int | None = None, last: int | None = None) -> float:
    """Return the mean centre error in pixels."""
    return float(np.nanmean(judged.error[judged.window(first, last)]))


@measure("overlap")
def mean_overlap(judged: JudgedRun, first: int | None = None, last: int | None = None) -> float:
    """Return the mean overlap in [0, 1]."""
    return float(np.nanmean(judged.overlap[judged.window(first, last)]))


@measure("frames")
def first_loss(judged: JudgedRun) -> float:
    """Return the number of frames before the target is lost for good."""
    on = np.flatnonzero(judged.on_target)
    return float(on[-1] + 1 if len(on) else 0)


@measure("share")
def all_on_target(judged: JudgedRun, first: int, last: int) -> float:
    """Return 1 if the target is tracked in every frame of a range."""
    return float(judged.on_target[judged.window(first, last)].all())


def _lost_before_event(
    judged: JudgedRun, on: str = "", off: str = "", once_off: str = "", mean_off: str = ""
) -> float:
    event = min(parse_frames("+".join(filter(None, [off, once_off, mean_off]))), default=None)
    before = [frame for frame in parse_frames(on) if event is None or frame < event]
    return float(not _on_at(judged, before).all()) if before else 0.0


@measure("share", lost_before=_lost_before_event)
def pattern(
    judged: JudgedRun, on: str = "", off: str = "", once_off: str = "", mean_off: str = ""
) -> float:
    """Return 1 if the target is tracked and lost in the frames that the options name.

    `on=11+16`: tracked in all of these frames. `off=58+100`: tracked in none of them.
    `once_off=12-15`: not tracked in at least one of them. `mean_off=36-51`: the mean error over
    them exceeds the tolerance.
    """
    holds = bool(_on_at(judged, parse_frames(on)).all()) if on else True
    holds &= not (off and _on_at(judged, parse_frames(off)).any())
    holds &= not (once_off and _on_at(judged, parse_frames(once_off)).all())
    if mean_off:
        frames = parse_frames(mean_off)
        holds &= mean_error(judged, frames[0], frames[-1]) > judged.tolerance
    return float(holds)
