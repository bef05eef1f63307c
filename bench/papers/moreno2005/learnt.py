"""Deviations of the dynamics that were learnt from a segmented sequence, and those set by hand.

`as-written` has the former, `recommended` the latter; here each preset has the other's (MO-23).
"""

import pandas as pd

from bench.experiments.contestant import contestant
from bench.experiments.experiment import Experiment, SequenceSource
from datasets.text_form import format_text

__all__ = ["LEARNT", "OTHERS", "PROPOSED", "by_deviations", "is_deviation", "learnt_experiment"]

LEARNT = "moreno2005-learnt"

PRESETS = ("as-written", "recommended")
PROPOSED, OTHERS = "proposed", "other deviations"
"""What the method is called with a preset's own, and with those of the other."""

SCENES, REPETITIONS = 10, 3


def is_deviation(parameter: str) -> bool:
    """Whether a parameter of the tracker says how far its dynamics stray."""
    return parameter.endswith("_spread") or parameter == "jump_probability"


def learnt_experiment(most: int | None) -> Experiment:
    """Both presets with the deviations of the other, where the light jumps again and again.

    Parameters
    ----------
    most : int or None
        Most repetitions.
    """
    settled = {preset: contestant(f"moreno2005:preset={preset}") for preset in PRESETS}
    texts = []
    for preset, other in zip(PRESETS, PRESETS[::-1], strict=True):
        taken = {
            key: value for key, value in settled[other].parameters.items() if is_deviation(key)
        }
        texts.append(format_text("moreno2005", {"preset": preset, **taken}))
    scenes = [f"moreno2005/ellipse:light=repeated:scene={number}" for number in range(SCENES)]
    return Experiment(
        name=LEARNT,
        title="Dependent cues, deviations learnt and set by hand",
        trackers=tuple(texts),
        sequences=tuple(map(SequenceSource, scenes)),
        repetitions=min(REPETITIONS, most or REPETITIONS),
    )


def by_deviations(scores: pd.DataFrame) -> pd.DataFrame:
    """Rows of the scores that `deviations` (`learnt`, `by hand`) tells apart."""
    pieces = []
    for method, named in ((PROPOSED, ("learnt", "by hand")), (OTHERS, ("by hand", "learnt"))):
        runs = scores[scores["method"] == method]
        said = dict(zip(PRESETS, named, strict=True))
        pieces.append(runs.assign(deviations=runs["preset"].map(said)))
    return pd.concat(pieces, ignore_index=True)
