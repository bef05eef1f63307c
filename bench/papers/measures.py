"""Measures of a run; a specification is, for example, `mean_error:first=36:last=80`.

A measure is a function of a `JudgedRun` with the decorator `@measure`. A paper's `measures.py` adds
further measures. Frames are numbered as in the paper.
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

KEPT_SHARE = 0.9  # minimum share of the visible frames in which a kept target is tracked
LAST_FRAMES = 10  # number of last visible frames, in all of which a kept target is tracked
MIN_VISIBLE = 0.3  # minimum visible share of the target in a visible frame
TOLERANCE = 0.5  # largest centre error of a tracked frame [mean box sides]


@dataclass(frozen=True)
class JudgedRun:
    """Run with the ground truth of its sequence.

    A failed run is measured as if it had no estimate after the initialisation.
    """

    run: Run
    truth: StoredTruth  # boxes are those of the init region
    description: Description  # content of `paper.toml`
    tracker: str  # specification

    @cached_property
    def boxes(self) -> Values:
        """Online or revised boxes in pixels, shape (n, 4); NaN after init if the run failed."""
        boxes = np.array(self.run.boxes_in(self.description.trace), np.float64)
        if self.run.failure:
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
        """True in frames with a positive value of the paper's measure `on_target`, shape (n,)."""
        name = self.description.on_target
        return np.asarray(series(name, self.description.name)(self), np.float64) > 0

    def in_trace(self, trace: str) -> "JudgedRun":
        """Return the run with its `online` or `revised` boxes; unchanged if `trace` is empty."""
        if not trace:
            return self
        return replace(self, description=self.description.model_copy(update={"trace": trace}))

    def detail(self, name: str) -> Values:
        """Return a detail that the tracker stored by frame, shape (n,); NaN if there is none."""
        values = self.run.details.get(name)
        return np.full(len(self.truth.boxes), nan) if values is None else np.asarray(values, float)

    def window(self, first: int | None, last: int | None) -> slice:
        """Return the slice of frames `first` to `last`, both included, in the paper's numbering."""
        start = self.description.frames_from
        stop = len(self.truth.boxes) if last is None else last - start + 1
        return slice(0 if first is None else first - start, stop)


@dataclass(frozen=True)
class Measure:
    """Measure with its options."""

    function: Function  # returns a number for a `JudgedRun`
    text: str  # specification
    unit: str  # such as `share`, `px` or `frames`
    lower_is_better: bool
    lost_before: Function | None  # returns 1 if the target is lost before the event, else 0

    def __call__(self, judged: JudgedRun) -> float:
        """Return the value of the measure for a run."""
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
    """Return a module in a paper's folder; None if it does not exist."""
    try:
        return importlib.import_module(f"trackmark.bench.papers.{paper}.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"trackmark.bench.papers.{paper}.{name}":
            raise
        return None


def measure_function(name: str, paper: str) -> Any:
    """Return the function of a measure of the paper, else of a common one; None if unknown."""
    return getattr(paper_module(paper, "measures"), name, None) or globals().get(name)


@cache
def find_measure(text: str, paper: str) -> Measure:
    """Return the measure of a specification; the paper's measures precede the common ones.

    Raises `ExperimentError` for an unknown name or option.
    """
    name, options = parse_text(text)
    function = measure_function(name, paper)
    declared = getattr(function, "declared", None)
    if function is None or declared is None:
        raise ExperimentError(f"bench/papers/{paper}: unknown measure {name!r} in {text!r}.")
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
    """Return `module.function` of a paper's modules; raise `ExperimentError` if it is missing."""
    module, _, function = name.rpartition(".")
    attribute = getattr(paper_module(paper, module), function, None)
    if attribute is None:
        raise ExperimentError(
            f"bench/papers/{paper}: unknown function {name!r}. Expected: MODULE.FUNCTION."
        )
    return attribute


def check_measure(text: str, paper: str) -> None:
    """Raise `ExperimentError` if a claim's measure does not exist or has no such option."""
    name = text.partition(":")[0]
    if "." in name:
        find_function(name, paper)
    else:
        find_measure(text, paper)


def typed_option(value: str, annotation: Any) -> Any:
    """Convert the text of an option to the annotated type of a parameter."""
    if annotation in (bool, "bool"):
        return value == "true"
    if annotation in (float, "float"):
        return float(value)
    return int(value) if "int" in str(annotation) else value


def series(name: str, paper: str) -> Callable[[JudgedRun], Values]:
    """Return a function for a series by frame: the paper's, a common one, or a detail."""
    paper_series = getattr(paper_module(paper, "measures"), "SERIES", {})
    return paper_series.get(name) or SERIES.get(name) or (lambda judged: judged.detail(name))


def _inside(judged: JudgedRun) -> Values:
    """Return 1 if the centre of the estimate lies inside the ground-truth box, else 0."""
    centres = judged.boxes[:, :2] + judged.boxes[:, 2:] / 2
    low, size = judged.truth.boxes[:, :2], judged.truth.boxes[:, 2:]
    return np.asarray(((centres >= low) & (centres <= low + size)).all(axis=1), np.float64)


SERIES: dict[str, Callable[[JudgedRun], Values]] = {
    "error": lambda judged: judged.error,
    "overlap": lambda judged: judged.overlap,
    "within": lambda judged: np.asarray(judged.error <= judged.tolerance, np.float64),
    "inside": _inside,
    "visible": lambda judged: np.asarray(judged.truth.visibility, np.float64),
}


def parse_frames(text: str) -> list[int]:
    """Parse frames such as `11+16`, `12-15` or `1+12-15`; ranges include both ends."""
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
    """Return the number of frames up to the last frame in which the target is tracked."""
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
    """Return 1 if the target is tracked and lost in the frames of the options, else 0.

    `on=11+16`: tracked in all of these frames. `off=58+100`: tracked in none of them.
    `once_off=12-15`: not tracked in at least one of them. `mean_off=36-51`: the mean error over
    these frames exceeds the tolerance.
    """
    holds = bool(_on_at(judged, parse_frames(on)).all()) if on else True
    holds &= not (off and _on_at(judged, parse_frames(off)).any())
    holds &= not (once_off and _on_at(judged, parse_frames(once_off)).all())
    if mean_off:
        frames = parse_frames(mean_off)
        holds &= mean_error(judged, frames[0], frames[-1]) > judged.tolerance
    return float(holds)
