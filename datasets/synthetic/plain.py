"""Plain scenes: one difficulty at a time.

`plain/target` is a two-coloured target that moves over a textured ground. By default
nothing is hard about it; each knob makes one thing hard.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from datasets.interface import Sequence
from datasets.synthetic.target.knobs import TargetKnobs

__all__ = ["load", "names", "options"]


def names() -> list[str]:
    """Names of the sequences, without options."""
    return ["plain/target"]


def options(name: str) -> list[dict[str, Any]]:
    """What can be set of a sequence: `name`, `default` and `meaning` of every knob."""
    return TargetKnobs.described()


def load(name: str, options: Mapping[str, str]) -> Sequence:
    """Sequence of one of `names()` with some knobs set; renders nothing.

    Raises
    ------
    SequenceError
        For an unknown knob or a value out of its bounds.
    """
    knobs = TargetKnobs.checked(name, options)
    # The renderer brings Numba: loaded only where a sequence is opened.
    from datasets.synthetic.engine.scene import open_scene
    from datasets.synthetic.target.scene import TargetScene

    return open_scene(name, knobs, TargetScene(knobs), Path(__file__))
