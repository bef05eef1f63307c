"""The walking sequences of a paper on single- and multi-part colour histograms.

Eight analogues of the eight videos that the paper describes, drawn from its words alone
(`walking/designs.py`): other videos, new in every scene.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from datasets.interface import Sequence
from datasets.synthetic.walking.designs import DESIGNS
from datasets.synthetic.walking.knobs import WalkingKnobs

__all__ = ["load", "names", "options"]


def names() -> list[str]:
    """Names of the sequences, without options."""
    return [f"multipart/{number}" for number in DESIGNS]


def options(name: str) -> list[dict[str, Any]]:
    """What can be set of a sequence: `name`, `default` and `meaning` of every knob."""
    return WalkingKnobs.described()


def load(name: str, options: Mapping[str, str]) -> Sequence:
    """Sequence of one of `names()` with some knobs set; renders nothing.

    Raises
    ------
    SequenceError
        For an unknown knob or a value out of its bounds.
    """
    knobs = WalkingKnobs.checked(name, options)
    # The renderer brings Numba: loaded only where a sequence is opened.
    from datasets.synthetic.engine.scene import open_scene
    from datasets.synthetic.walking.casting import multipart_plan
    from datasets.synthetic.walking.scene import WalkingScene

    plan = multipart_plan(name.partition("/")[2], knobs.scene)
    return open_scene(name, knobs, WalkingScene(plan, knobs.light), Path(__file__))
