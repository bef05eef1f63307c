"""The sequences of a paper on fusing cues that depend on one another.

Analogues of the paper's own recordings, and of its synthetic ellipse, drawn from its words alone:
other videos, new in every scene. All have exact masks of what is seen of the target.
"""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from datasets.interface import Sequence
from datasets.synthetic.bending_book.knobs import BookKnobs
from datasets.synthetic.ellipse.knobs import EllipseKnobs
from datasets.synthetic.engine.knobs import Knobs
from datasets.synthetic.foliage.knobs import LeafKnobs
from datasets.synthetic.seabed.knobs import OctopusKnobs

if TYPE_CHECKING:
    from datasets.synthetic.engine.scene import Scene

__all__ = ["load", "names", "options"]

SCENES: dict[str, tuple[type[Knobs], str]] = {
    "moreno2005/ellipse": (EllipseKnobs, "datasets.synthetic.ellipse.scene"),
    "moreno2005/octopus": (OctopusKnobs, "datasets.synthetic.seabed.scene"),
    "moreno2005/book": (BookKnobs, "datasets.synthetic.bending_book.scene"),
    "moreno2005/leaf": (LeafKnobs, "datasets.synthetic.foliage.scene"),
}
"""By name: the knobs, and the module that makes a scene of them (a `SceneModule`).

A sequence's fingerprint covers its module and all that this imports, not its neighbours here.
"""


class SceneModule(Protocol):
    """What a module offers that stands in `SCENES`."""

    __file__: str

    def scene(self, knobs: Any) -> "Scene":
        """Renderer and truth; nothing is painted."""
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
