"""The sequences of a paper on an improved CamShift inside a particle filter.

Analogues of the three videos on which the paper shows its trackers, drawn from its words
alone: other videos, new in every scene. The paper counts frames from 1; its frame k is ours
k - 1.
"""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from datasets.interface import Sequence
from datasets.synthetic.engine.knobs import Knobs
from datasets.synthetic.gesture.knobs import HandKnobs
from datasets.synthetic.kitchen.knobs import CupKnobs
from datasets.synthetic.table_tennis.knobs import TableTennisKnobs

if TYPE_CHECKING:
    from datasets.synthetic.engine.scene import Scene

__all__ = ["load", "names", "options"]

SCENES: dict[str, tuple[type[Knobs], str]] = {
    "wang2010/table-tennis": (TableTennisKnobs, "datasets.synthetic.table_tennis.scene"),
    "wang2010/hand": (HandKnobs, "datasets.synthetic.gesture.scene"),
    "wang2010/cup": (CupKnobs, "datasets.synthetic.kitchen.scene"),
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
    checker, source = SCENES[name]
    knobs = checker.checked(name, options)
    # Renderers bring Numba: loaded only where a sequence is opened.
    module = cast(SceneModule, importlib.import_module(source))
    from datasets.synthetic.engine.scene import open_scene

    return open_scene(name, knobs, module.scene(knobs), Path(module.__file__))
