"""Runs as tables: J and F by sequence and method; none has a published number beside it."""

from collections.abc import Iterator

import pandas as pd

from bench.papers.moreno2005.learnt import PROPOSED
from bench.papers.moreno2005.scores import BASELINE, MODERATE
from bench.papers.tables import number_words, text_table
from reports.tables import MISSING, Table

__all__ = ["LIGHTS", "SEQUENCES", "UNPUBLISHED", "choices_table", "segmentation_table", "way_words"]

UNPUBLISHED = "no published numbers"
"""What stands under every table: the paper has none (MO-25)."""

METHODS = {
    PROPOSED: "dependent cues",
    "association=uniform": "uniform association",
    "position=kalman": "Kalman filter of the position",
    "plane_samples=1:plane_spread=0": "plane of the first frame",
    "colour_model=refitted": "refitted colours",
    "snake=false": "without snake",
    "snake_edges=all": "snake on all edges",
    "start=box": "start from the box",
    BASELINE: "smooth colour",
}
"""In words, and in the order of the tables; others come last."""

LIGHTS = {
    "even": "even light",
    "jump": "one jump",
    "repeated": "repeated jumps",
    "shadow": "a shadow's edge",
}
"""What the light does to the ellipse."""

SEQUENCES = {
    "moreno2005/ellipse": "ellipse",
    "moreno2005/octopus": "octopus",
    "moreno2005/book": "book",
    "moreno2005/leaf": "leaf",
}

_SEQUENCE = ["sequence", "lighting", "clutter", "illuminant", "shadow", "jump"]
_WAY = ["method", "preset", "variant", "mixing", "plane"]
_HINDSIGHT = ("recommended", "robust")


def segmentation_table(scores: pd.DataFrame) -> Table:
    """All sequences by method, without variants.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`.
    """
    plain = scores[scores["variant"] == ""]
    return text_table(
        "segmentation",
        "Fig. 7 to 10, other videos: region similarity J and contour accuracy F, means over scenes "
        "[quartiles], each the mean of its frames and repetitions. Tracked: runs with J of .5 or "
        f"more in every frame; gone: with J below .1 in one. {UNPUBLISHED.capitalize()}",
        list(_rows(plain)),
        n_labels=3,
    )


def choices_table(scores: pd.DataFrame) -> Table:
    """What each choice makes of J: corrections, ablations, temperatures; one at a time."""
    names = scores.loc[scores["variant"] != "", "name"].unique()
    here = scores[scores["name"].isin(names) & (scores["method"] != BASELINE)]
    return text_table(
        "choices",
        "What decides the outcome: corrections of the text, ablations and temperatures, one at a "
        f"time; as the table before. {UNPUBLISHED.capitalize()}",
        list(_rows(here)),
        n_labels=3,
    )


def way_words(method: str, preset: str, variant: str, mixing: str, plane: str) -> tuple[str, str]:
    """Method and setting in words; what was chosen after seeing results is marked."""
    name = METHODS.get(method, method)
    if method == BASELINE:
        name += f", a = {mixing}" + (", plane refitted" if plane == "refitted" else "")
    words = preset_words(preset)
    return name, ", ".join([words, *variant.split(":")]) if variant else words


def preset_words(preset: str) -> str:
    """A preset in words; what was chosen after seeing results is marked."""
    return f"{preset} (post hoc)" if preset in _HINDSIGHT else preset.replace("-", " ")


def sequence_words(
    sequence: str, lighting: str, clutter: str, illuminant: str, shadow: str, jump: str
) -> str:
    """A sequence and its variant in words."""
    name = SEQUENCES.get(sequence, sequence)
    further = {
        "moreno2005/ellipse": [
            LIGHTS.get(lighting, lighting),
            *(["moderate clutter (post hoc)"] if clutter == MODERATE else []),
        ],
        "moreno2005/book": [f"{illuminant} light", f"shadow: {shadow}"],
        "moreno2005/leaf": [f"light's jump: {jump}"],
    }
    return ", ".join([name, *further.get(sequence, [])])


def _rows(scores: pd.DataFrame) -> Iterator[dict[str, str]]:
    order = {method: place for place, method in enumerate(METHODS)}
    found = scores[_SEQUENCE].drop_duplicates().itertuples(index=False, name=None)
    for where in sorted(found, key=_place):
        here = scores[(scores[_SEQUENCE] == list(where)).all(axis=1)]
        ways = here[_WAY].drop_duplicates().itertuples(index=False, name=None)
        for way in sorted(ways, key=lambda way: (order.get(way[0], len(order)), *way)):
            runs = here[(here[_WAY] == list(way)).all(axis=1)]
            method, setting = way_words(*way)
            yield {
                "sequence": sequence_words(*where),
                "method": method,
                "setting": setting,
                "J": scene_words(runs, "mean_region_similarity"),
                "F": scene_words(runs, "mean_contour_accuracy"),
                "tracked": _count(runs, "tracked"),
                "gone": _count(runs, "gone"),
                "lost by the jump": _count(runs, "lost_by_jump"),
                "scenes": str(runs["scene"].nunique()),
            }


def _place(where: tuple[str, ...]) -> tuple[int | str, ...]:
    """Sequences in the order of the paper's figures, the ellipse's by light."""
    sequence, lighting, *rest = where
    known = list(SEQUENCES), list(LIGHTS)
    places = [
        names.index(name) if name in names else len(names)
        for names, name in zip(known, (sequence, lighting), strict=True)
    ]
    return (*places, *rest)


def scene_words(runs: pd.DataFrame, metric: str) -> str:
    """Mean [quartiles] over scenes, each the mean of its repetitions."""
    failed = int((runs["failure"] != "").sum())
    if failed:
        return f"{MISSING} ({failed} of {len(runs)} failed)"
    values = runs.groupby("scene")[metric].mean()
    low, high = (number_words(float(values.quantile(q)), 3) for q in (0.25, 0.75))
    return f"{number_words(float(values.mean()), 3)} [{low}–{high}]"


def _count(runs: pd.DataFrame, metric: str) -> str:
    known = runs[metric].dropna()
    return f"{known.sum():.0f} of {len(known)}" if len(known) else MISSING
