"""Fig. 9 as small multiples, over readings of the text and over scenes."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from bench.papers.nummiaro2003.stored import UPDATE, AdaptiveRuns
from bench.papers.stored import over_frames
from datasets.text_form import format_text
from reports.series import series_grid

__all__ = ["scale_grids"]

TRAFFIC = "nummiaro2003/traffic"

PRESETS: Mapping[str, Mapping[str, object]] = {
    "as written": {},
    "recommended": {"preset": "recommended"},
}
_APART = {"axes": "apart", "scale_change": "multiplicative", "size_noise": 0.02}
_DYNAMICS: Mapping[str, Mapping[str, object]] = {
    "apart, damped": {**_APART, "scale_persistence": 0.9, "scale_noise": 0.008},
    "apart": _APART,
    "together, factors": {"scale_change": "multiplicative"},
    "linear": {},
}
READINGS: Mapping[str, Mapping[str, object]] = {
    f"{words}, σ {sigma}": {"update_reading": "coefficient", "sigma": sigma, **parameters}
    for words, parameters in _DYNAMICS.items()
    for sigma in (0.1, 0.05)
}
"""Those of the experiment on Fig. 9 that have the printed weights."""

GRIDS: Mapping[str, tuple[str, Mapping[str, Mapping[str, object]], tuple[int, ...], str]] = {
    "figure-9-scenes": (
        "nummiaro2003-figure-8",
        PRESETS,
        (0, 1, 2, 3),
        "Fig. 9 on several scenes",
    ),
    "figure-9-readings": (
        "nummiaro2003-figure-9",
        READINGS,
        (8, 9, 10, 11),
        "Fig. 9 over readings of the dynamics and of σ (update where ρ > 0.9; post hoc)",
    ),
}
"""By name: experiment, readings, scenes, headline."""


def scale_grids(stored: AdaptiveRuns) -> dict[str, Figure]:
    """Hx of the mean state with and without update, by name; none without runs."""
    plots = {}
    for name, (experiment, readings, scenes, title) in GRIDS.items():
        pieces, truths = [], {}
        for reading, parameters in readings.items():
            for scene in scenes:
                sequence = format_text(TRAFFIC, {"scene": scene} if scene else {})
                runs = stored.by_update(experiment, sequence, **parameters)
                found = [run for repetitions in runs.values() for run in repetitions]
                if found:
                    where = {"reading": reading, "scene": f"scene {scene}"}
                    rows = over_frames(runs, "half_width").rename(columns={"half_width": "value"})
                    pieces.append(rows.assign(**where))
                    truths[where["scene"]] = stored.truth(experiment, found[0]).boxes[:, 2] / 2
        if pieces:
            series = pd.concat(pieces, ignore_index=True)
            plots[name] = series_grid(series, title, "Hx [px]", list(UPDATE), truths)
    return plots
