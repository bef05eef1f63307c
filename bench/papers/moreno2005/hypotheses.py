"""The paper's Fig. 5: hypotheses of all three cues in a frame, and posterior maps of some."""

import numpy as np
from matplotlib.figure import Figure

from bench.papers.moreno2005.colour_model import gaussians
from bench.papers.moreno2005.one_step import FRAME, Step
from reports.hypotheses import Palette, hypotheses_plot
from trackers.contours.fisher.mixture import mixture_of

__all__ = ["hypotheses_figure", "palettes_of"]


def hypotheses_figure(step: Step, label: str) -> Figure:
    """Fig. 5: planes, contours, and the heaviest, the median and the lightest colours.

    Parameters
    ----------
    step : Step
        Of a frame.
    label : str
        What the tracker's parameters are called.
    """
    return hypotheses_plot(
        step.image,
        (step.bases, step.planes.weights),
        (step.contours.states, step.contours.weights),
        palettes_of(step),
        f"Fig. 5, {label}, not the paper's video but {FRAME}: "
        "hypotheses, darker with more weight; right: some of the colours on their planes, and "
        "posterior maps by them",
    )


def palettes_of(step: Step) -> dict[str, Palette]:
    """Colours with the greatest, the median and the least weight, by what is said of them."""
    weights = step.colours.weights
    order = np.argsort(-weights, kind="stable")
    places = {"greatest": 0, "median": len(order) // 2, "least": len(order) - 1}
    found = {}
    for words, place in places.items():
        number = int(order[place])
        assert step.colours.attached is not None
        mixture = step.colours.states[number]
        found[f"{words} weight: {weights[number] * len(weights):.2g} times the mean"] = Palette(
            {
                "target": gaussians(mixture_of(mixture[: step.of_target])),
                "background": gaussians(mixture_of(mixture[step.of_target :])),
            },
            step.posterior(number),
        )
    return found
