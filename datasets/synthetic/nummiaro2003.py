"""The sequences of a paper on an adaptive colour-based particle filter.

Analogues of the five videos that the paper shows, drawn from its words alone: other videos,
new in every scene.
"""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from datasets.interface import Sequence, SequenceError
from datasets.synthetic.campus.knobs import PersonKnobs, StudentsKnobs
from datasets.synthetic.driving.knobs import DrivingKnobs
from datasets.synthetic.engine.knobs import Knobs
from datasets.synthetic.factory.knobs import HeadKnobs
from datasets.text_form import parse_text

if TYPE_CHECKING:
    from datasets.synthetic.engine.scene import Scene

__all__ = ["entries", "load", "names", "options"]

SCENES: dict[str, tuple[type[Knobs], str]] = {
    "nummiaro2003/person": (PersonKnobs, "datasets.synthetic.campus.person"),
    "nummiaro2003/car": (DrivingKnobs, "datasets.synthetic.driving.parking"),
    "nummiaro2003/students": (StudentsKnobs, "datasets.synthetic.campus.students"),
    "nummiaro2003/traffic": (DrivingKnobs, "datasets.synthetic.driving.traffic"),
    "nummiaro2003/head": (HeadKnobs, "datasets.synthetic.factory.scene"),
}
"""By name: the knobs, and the module that makes a scene of them (a `SceneModule`).

A sequence's fingerprint covers its module and all that this imports, not its neighbours here.
"""


class SceneModule(Protocol):
    """What a module offers that stands in `SCENES`."""

    __file__: str

    def scene(self, knobs: Any) -> "Scene":
        """Renderer and truth; nothing is painted yet."""
        ...

    def entries(self, knobs: Any) -> NDArray[np.float64]:
        """See `entries` of the suite."""
        ...


def names() -> list[str]:
    """Names of the sequences, without options."""
    return list(SCENES)


def options(name: str) -> list[dict[str, Any]]:
    """What can be set of a sequence: `name`, `default` and `meaning` of every knob."""
    return SCENES[name][0].described()


def load(name: str, options: Mapping[str, str]) -> Sequence:
    """Sequence of one of `names()` with some knobs set; renders nothing.

    Raises
    ------
    SequenceError
        For an unknown knob or a value out of its bounds.
    """
    knobs, module = _opened(name, options)
    from datasets.synthetic.engine.scene import open_scene

    return open_scene(name, knobs, module.scene(knobs), Path(module.__file__))


def entries(name: str) -> NDArray[np.float64]:
    """Where a target can come into the picture: doors, and stretches of its borders.

    Parameters
    ----------
    name : str
        One of `names()` with options (`nummiaro2003/person:scene=2:start=empty`).

    Returns
    -------
    ndarray of float64, shape (k, 4)
        Boxes that hold the middle of a target which is just coming into view [pixels].

    Raises
    ------
    SequenceError
        For a name that is none of the suite's, and as `load`.
    """
    bare, options = parse_text(name)
    if bare not in SCENES:
        known = ", ".join(names())
        raise SequenceError(f"{name!r} has no known entries. Sequences that have: {known}.")
    knobs, module = _opened(bare, options)
    return module.entries(knobs)


def _opened(name: str, options: Mapping[str, str]) -> tuple[Knobs, SceneModule]:
    """Checked knobs, and the module of a sequence: it brings Numba, so it is loaded only now."""
    checker, module = SCENES[name]
    return checker.checked(name, options), cast(SceneModule, importlib.import_module(module))
