"""Scenes that put one weakness of a tracker to the test.

`stress/twin`: a second person comes near the target in the same clothes, or in others.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from datasets.interface import Sequence
from datasets.synthetic.walking.knobs import TwinKnobs

__all__ = ["load", "names", "options"]


def names() -> list[str]:
    """Names of the sequences, without options."""
    return ["stress/twin"]


def options(name: str) -> list[dict[str, Any]]:
    """What can be set of a sequence: `name`, `default` and `meaning` of every knob."""
    return TwinKnobs.described()


def load(name: str, options: Mapping[str, str]) -> Sequence:
    """Sequence of one of `names()` with some knobs set; renders nothing.

    Raises
    ------
    SequenceError
        For an unknown knob or a value out of its bounds.
    """
    knobs = TwinKnobs.checked(name, options)
    # The renderer brings Numba: loaded only where a sequence is opened.
    from datasets.synthetic.engine.scene import open_scene
    from datasets.synthetic.walking.casting import twin_plan
    from datasets.synthetic.walking.scene import WalkingScene

    plan = twin_plan(knobs.scene, knobs.distance, knobs.twin == "same")
    return open_scene(name, knobs, WalkingScene(plan, knobs.light), Path(__file__))
