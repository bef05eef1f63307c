"""The sequences of a paper on template tracking by colour-invariant pixel features.

Analogues of the paper's own recording, and of the clips that it took from an action film, drawn
from its words alone: other videos, new in every scene. A scene of the film is a set of twenty
clips.
"""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from datasets.interface import Sequence
from datasets.synthetic.engine.knobs import Knobs
from datasets.synthetic.film.knobs import FilmKnobs
from datasets.synthetic.lamps.knobs import LightsKnobs

if TYPE_CHECKING:
    from datasets.synthetic.engine.scene import Scene

__all__ = ["load", "names", "options"]

CLIPS = 20
"""Clips in a set."""

SCENES: dict[str, tuple[type[Knobs], str]] = {
    "nguyen2002/lights": (LightsKnobs, "datasets.synthetic.lamps.scene"),
    **{
        f"nguyen2002/clip-{clip:02}": (FilmKnobs, "datasets.synthetic.film.scene")
        for clip in range(1, CLIPS + 1)
    },
}
"""By name: the knobs, and the module that makes a scene of them (a `SceneModule`).

A sequence's fingerprint covers its module and all that this imports, not its neighbours here.
"""


class SceneModule(Protocol):
    """What a module offers that stands in `SCENES`."""

    __file__: str

    def scene(self, knobs: Any, *clip: int) -> "Scene":
        """Renderer and truth of the only scene, or of the clip of a number; nothing is painted."""
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
    clip = [int(number) for number in name.split("-")[1:]]
    # Renderers bring Numba: loaded only where a sequence is opened.
    module = cast(SceneModule, importlib.import_module(source))
    from datasets.synthetic.engine.scene import open_scene

    return open_scene(name, knobs, module.scene(knobs, *clip), Path(module.__file__))
