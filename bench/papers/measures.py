"""Measures of a run, in text form: `mean_error:first=36:last=80`.

A measure is a function of a `Course` with a `@measure` line. Those here serve every paper; a
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
class Course:
    """A run beside the ground truth of its sequence, frame by frame.

    A failed run counts as one that gives no box after initialisation.

    Attributes
    ----------
    run : Run
        The run.
    truth : StoredTruth
        Ground truth that it was made with.
    description : Description
        The paper.
    tracker : str
        Text form of the tracker.
    """

    run: Run
    truth: StoredTruth
    description: Description
    tracker: str

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
        known = self.present & np.isfinite(self.boxes).all(axis=1)
        values = np.where(self.present, 0.0, nan)
        values[known] = overlap(self.truth.boxes[known], self.boxes[known])
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

    def in_trace(self, trace: str) -> "Course":
        """Return the course with the `online` or the `revised` boxes; empty for the paper's."""
        if not trace:
            return self
        return replace(self, description=self.description.model_copy(update={"trace": trace}))

    def detail(self, name: str) -> Values:
        """A number of the tracker by frame, shape (n,); NaN where it has none of this name."""
        known = self.run.details.get(name)
        return np.full(len(self.truth.boxes), nan) if known is None else np.asarray(known, float)

    def window(self, first: int | None, last: int | None) -> slice:
        """Frames from `first` to `last`, both included, as the paper numbers them."""
        start = self.description.frames_from
        stop = len(self.truth.boxes) if last is None else last - start + 1
        return slice(0 if first is None else first - start, stop)


@dataclass(frozen=True)
class Measure:
    """A measure with its options.

    Attributes
    ----------
    function : callable
        Gives the number of a `Course`.
    text : str
        Its text form.
    unit : str
        `share`, `px`, `frames` or another unit of the number.
    lower_is_better : bool
        Whether a smaller number is the better one.
    lost_before : callable or None
        Says of a course whether the target is lost before the event that the measure looks at.
    """

    function: Function
    text: str
    unit: str
    lower_is_better: bool
    lost_before: Function | None

    def __call__(self, course: Course) -> float:
        """Return the number of a run."""
        return float(self.function(course))


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
    known = inspect.signature(function).parameters
    if unknown := [key for key in options if key not in known]:
        raise ExperimentError(
            f"bench/papers/{paper}: measure {name!r} has no option {unknown[0]!r} ({text!r})."
        )
    typed = {key: typed_option(value, known[key].annotation) for key, value in options.items()}

    def given(chosen: Function) -> Function:
        return lambda course: chosen(course, **typed)

    before = given(lost_before) if lost_before else None
    return Measure(given(function), text, unit, lower_is_better, before)


def find_function(name: str, paper: str) -> Any:
    """Return a function of a paper's own modules, named as `module.function`.

    Raises
    ------
    ExperimentError
        If there is none.
    """
    module, _, function = name.rpartition(".")
    found = getattr(paper_module(paper, module), function, None)
    if found is None:
        raise ExperimentError(f"bench/papers/{paper}: there is no function {name!r}.")
    return found


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


def series(name: str, paper: str) -> Callable[[Course], Values]:
    """Return a series by frame: the paper's own, a common one, or a number of the tracker."""
    own = getattr(paper_module(paper, "measures"), "SERIES", {})
    return own.get(name) or SERIES.get(name) or (lambda course: course.detail(name))


def _within(course: Course) -> Values:
    return np.asarray(course.error <= course.tolerance, np.float64)


def _inside(course: Course) -> Values:
    """Return 1 where the centre of the estimate lies inside the true box, else 0."""
    centres = course.boxes[:, :2] + course.boxes[:, 2:] / 2
    low, size = course.truth.boxes[:, :2], course.truth.boxes[:, 2:]
    return np.asarray(((centres >= low) & (centres <= low + size)).all(axis=1), np.float64)


SERIES: dict[str, Callable[[Course], Values]] = {
    "error": lambda course: course.error,
    "overlap": lambda course: course.overlap,
    "within": _within,
    "inside": _inside,
    "visible": lambda course: np.asarray(course.truth.visibility, np.float64),
}


def at_frames(text: str) -> list[int]:
    """Return the frames of `11+16` or `12-15` or both, as numbers."""
    frames: list[int] = []
    for part in filter(None, text.split("+")):
        first, _, last = part.partition("-")
        frames += range(int(first), int(last or first) + 1)
    return frames


def _on_at(course: Course, frames: list[int]) -> NDArray[np.bool_]:
    return course.on_target[[frame - course.description.frames_from for frame in frames]]


@measure("share")
def kept(course: Course) -> float:
    """Return 1 if the target is tracked in 90 % of the visible frames and in the last ten."""
    on = course.on_target[course.visible]
    return float(on.mean() >= KEPT_SHARE and bool(on[-LAST_FRAMES:].all()))


@measure("share")
def on_target(course: Course, first: int | None = None, last: int | None = None) -> float:
    """Return the share of the visible frames in which the target is tracked."""
    window = course.window(first, last)
    return float(course.on_target[window][course.visible[window]].mean())


@measure("frames")
def frames_on_target(course: Course) -> float:
    """Return the number of frames in which the target is tracked."""
    return float(course.on_target.sum())


@measure("px", lower_is_better=True)
def mean_error(course: Course, first: int | None = None, last: int | None = None) -> float:
    """Return the mean centre error in pixels."""
    return float(np.nanmean(course.error[course.window(first, last)]))


@measure("overlap")
def mean_overlap(course: Course, first: int | None = None, last: int | None = None) -> float:
    """Return the mean overlap in [0, 1]."""
    return float(np.nanmean(course.overlap[course.window(first, last)]))


@measure("frames")
def first_loss(course: Course) -> float:
    """Return the number of frames before the target is lost for good."""
    on = np.flatnonzero(course.on_target)
    return float(on[-1] + 1 if len(on) else 0)


@measure("share")
def all_on_target(course: Course, first: int, last: int) -> float:
    """Return 1 if the target is tracked in every frame of a range."""
    return float(course.on_target[course.window(first, last)].all())


def _lost_before_event(
    course: Course, on: str = "", off: str = "", once_off: str = "", mean_off: str = ""
) -> float:
    event = min(at_frames("+".join(filter(None, [off, once_off, mean_off]))), default=None)
    before = [frame for frame in at_frames(on) if event is None or frame < event]
    return float(not _on_at(course, before).all()) if before else 0.0


@measure("share", lost_before=_lost_before_event)
def pattern(
    course: Course, on: str = "", off: str = "", once_off: str = "", mean_off: str = ""
) -> float:
    """Return 1 if the target is tracked in some frames and not in others.

    `on=11+16` names frames in which it is tracked, `off=58+100` frames in none of which it is,
    `once_off=12-15` frames in at least one of which it is not, `mean_off=36-51` frames over which
    the mean error exceeds the tolerance.
    """
    holds = bool(_on_at(course, at_frames(on)).all()) if on else True
    holds &= not (off and _on_at(course, at_frames(off)).any())
    holds &= not (once_off and _on_at(course, at_frames(once_off)).all())
    if mean_off:
        frames = at_frames(mean_off)
        holds &= mean_error(course, frames[0], frames[-1]) > course.tolerance
    return float(holds)
