"""What was measured on the scenes, in figures: how a target looks, how one that enters is found."""

from collections.abc import Iterator, Mapping

import pandas as pd

from bench.papers.tables import text_table
from reports.tables import Table

__all__ = ["entrance_table", "scene_table"]

Tables = Mapping[str, pd.DataFrame]

SEEN = ((0.0, 0.2), (0.2, 0.4), (0.4, 0.6), (0.6, 0.8), (0.8, 1.0))
"""Visible fractions of a target that is partly hidden."""

REGIONS = {
    "extents": "upright ellipse in its extents",
    "circle": "greatest circle in it, upright anyway",
}


def scene_table(tables: Tables) -> Table:
    """Quantities that stand behind verdicts, or beside them, a row each.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        See `checks`; what is not there was not measured.
    """
    data = []
    for quantity, values in _quantities(tables):
        known = values.dropna()
        if len(known):
            low, middle, high = (known.quantile(q) for q in (0.25, 0.5, 0.75))
            data.append(
                {
                    "quantity": quantity,
                    "median [quartiles]": f"{middle:.2f} [{low:.2f}–{high:.2f}]",
                    "least": f"{known.min():.2f}",
                    "greatest": f"{known.max():.2f}",
                    "measured": str(len(known)),
                }
            )
    return text_table(
        "scenes",
        "What was measured on the scenes, over all of them: ρ is the coefficient of the true "
        "ellipse with the model of the first frame (of a turned target, with that before the turn)",
        data,
        n_labels=1,
    )


def entrance_table(tables: Tables) -> Table:
    """What becomes of a target that enters where samples wait, by kick-off fraction (Fig. 3)."""
    names = [name for name in ("entrance", "kick_off") if name in tables]
    keys = ["name", "preset", "kick_off", "repetition"]
    data = []
    if names:
        runs = pd.concat([tables[name] for name in names]).drop_duplicates(keys)
        for (preset, kick_off), found in runs.groupby(["preset", "kick_off"]):
            data.append(
                {
                    "preset": str(preset),
                    "b": f"{kick_off:g}",
                    "found in time [%]": f"{100 * found['started'].mean():.0f}",
                    "kept [%]": f"{100 * found['kept'].mean():.0f}",
                    "no false start [%]": f"{100 * found['no_false_start'].mean():.0f}",
                    "false starts per 100 empty frames": f"{found['false_start_rate'].mean():.2f}",
                    "runs": str(len(found)),
                }
            )
    return text_table(
        "entrance",
        "Fig. 3 in figures: a known target comes in by a door or border where samples wait. Found "
        "in time: within ten frames of its being visible tracking has begun on it; kept: it is "
        "tracked ten frames after that",
        data,
        n_labels=2,
    )


def _quantities(tables: Tables) -> Iterator[tuple[str, "pd.Series[float]"]]:
    """What is measured, in words, and its values."""
    if "transformed" in tables:
        turned = tables["transformed"].query("transformation == 'rotation'")
        yield "ρ of a turned target, the ellipse turned with it", turned["coefficient"]
    if "transformed_upright" in tables:
        upright = tables["transformed_upright"]
        for region, words in REGIONS.items():
            chosen = upright["region"] == region
            yield f"ρ of a turned target, {words}", upright[chosen]["coefficient"]
    if "occlusion_curve" in tables:
        curve = tables["occlusion_curve"]
        for low, high in SEEN:
            seen = curve[curve["visibility"].between(low, high, inclusive="right")]
            words = f"ρ of a student of whom {100 * low:.0f} to {100 * high:.0f} % are visible"
            yield words, seen["coefficient"]
    if "kernels" in tables:
        for kernel, rows in tables["kernels"].groupby("kernel", sort=False):
            yield f"error of the centre at the greatest ρ, {kernel} [Hx]", rows["centre_error"]
    if "maximum" in tables:
        for preset, rows in tables["maximum"].groupby("preset", sort=False):
            yield f"mean state to the greatest ρ, {preset} [Hx]", rows["distance"]
            yield f"spread of the samples, {preset} [Hx]", rows["spread"]
    if "wrong_models" in tables:
        for preset, rows in tables["wrong_models"].groupby("preset", sort=False):
            words = "share of the samples' own models nearer to clutter than to the first"
            yield f"{words}, {preset}", rows["nearer_clutter"]
