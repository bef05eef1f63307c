"""Runs as tables: Table 1 and the recording in figures, and what each choice makes of them."""

from collections.abc import Iterator

import pandas as pd

from bench.claims.ledger import ANY
from bench.papers.nguyen2002.measures import CLIPS, N_CLIPS
from bench.papers.nguyen2002.scores import COLOURED, LIGHTS
from bench.papers.tables import number_words, text_table
from datasets.text_form import parse_text
from reports.tables import MISSING, Table

__all__ = ["PUBLISHED", "choices_table", "clips_table", "lights_table", "setting"]

PUBLISHED = {"intensity": (16, 17), "rgb": (16, 17), "invariants": (11, 14)}
"""Table 1: clips tracked of 20, and occlusions detected of 21, by features."""

FEATURES = {
    ("intensity", ANY): "intensity",
    ("rgb", ANY): "RGB",
    ("invariants", "ratio"): "c1c2c3",
    ("invariants", "arctan"): "arctan of c1c2c3, the cited definition",
}
SETTINGS = (
    ("as-written", ""),
    ("as-written", "longest_occlusion=67"),
    ("recommended", ""),
    ("recommended", "ties=ascending"),
    ("robust", ""),
)
"""Of Table 1, in its order: presets and variants."""

SAID_HIDDEN = "said hidden [% of frames in sight]"
"""Head: how often the tracker follows nothing though there is nothing before the target."""

LAMPS = {LIGHTS: "white", COLOURED: "coloured"}

_HINDSIGHT = ("recommended", "robust")
_VARIANTS = {"longest_occlusion": "L", "gamma": "γ", "average": "K"}


def setting(preset: str, variant: str) -> str:
    """How the tracker was run, in words; what was chosen after seeing results is marked."""
    words = [f"{preset} (post hoc)" if preset in _HINDSIGHT else preset.replace("-", " ")]
    for key, value in parse_text(f":{variant}")[1].items() if variant else ():
        words.append(f"{_VARIANTS.get(key, key.replace('_', ' '))} = {value}")
    return ", ".join(words)


def clips_table(sets: pd.DataFrame) -> Table:
    """Table 1, and what the paper does not say: what was declared, and declared without need.

    Parameters
    ----------
    sets : DataFrame
        See `set_table`.
    """
    here = sets[sets["sequence"] == CLIPS]
    data = []
    for features, definition, preset, variant, runs in _ways(here):
        if (preset, variant) not in SETTINGS:
            continue
        revised, online = (runs[runs["trace"] == trace] for trace in ("revised", "online"))
        is_published = definition != "arctan" and (preset, variant) == SETTINGS[0]
        clips, occlusions = PUBLISHED[features] if is_published else (MISSING, MISSING)
        data.append(
            {
                "features": FEATURES[features, definition],
                "setting": setting(preset, variant),
                "clips tracked, revised": _spread(revised["tracked"]),
                "paper (other data)": str(clips),
                "clips tracked, online": _spread(online["tracked"]),
                "occlusions detected, revised": _spread(revised["detected"]),
                "paper (other data) ": str(occlusions),
                "occlusions detected, online": _spread(online["detected"]),
                "declared": _spread(revised["declared"]),
                "false ones a clip": number_words(revised["false_occlusions"].mean(), 2),
                SAID_HIDDEN: number_words(100 * online["said_hidden"].mean(), 0),
                "overlap, revised": number_words(revised["mean_overlap"].mean(), 3),
                "overlap, online": number_words(online["mean_overlap"].mean(), 3),
                "sets": str(len(revised)),
            }
        )
    return text_table(
        "table-1",
        f"Table 1, other videos: of {N_CLIPS} clips with 21 complete occlusions, means (ranges) "
        "over sets. Revised: with what the tracker says in the end, as the paper's looks ahead; "
        "online: what it says at once. Detected: declared, and found again. Said hidden: at once, "
        "of the frames that show 90 % of the target",
        data,
        n_labels=2,
    )


def lights_table(scores: pd.DataFrame) -> Table:
    """The recording: what was tracked to the end, and where the others were lost.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`.
    """
    data = []
    for sequence, lamps in LAMPS.items():
        here = scores[(scores["sequence"] == sequence) & (scores["failure"] == "")]
        for features, definition, preset, variant, runs in _ways(here):
            if (preset, variant) not in SETTINGS:
                continue
            revised, online = (runs[runs["trace"] == trace] for trace in ("revised", "online"))
            lost = revised[revised["first_loss"] < revised["frames"]]
            at_on = (lost["lost_at_switch"] - lost["lost_at_off"]).sum()
            elsewhere = len(lost) - lost["lost_at_switch"].sum()
            data.append(
                {
                    "lamps": lamps,
                    "features": FEATURES[features, definition],
                    "setting": setting(preset, variant),
                    "tracked, revised": _count(revised["success"]),
                    "tracked, online": _count(online["success"]),
                    "never lost, revised": _count(revised["first_loss"] >= revised["frames"]),
                    "lost at lamp off / on / elsewhere": (
                        f"{lost['lost_at_off'].sum():.0f} / {at_on:.0f} / {elsewhere:.0f}"
                    ),
                    "kept after lamp off [%]": number_words(
                        100 * revised["kept_after_off"].mean(), 0
                    ),
                    "occlusions detected, revised": (
                        f"{revised['detected'].sum():.0f} of {revised['occlusions'].sum():.0f}"
                    ),
                    "false ones": number_words(revised["false_occlusions"].mean(), 1),
                    SAID_HIDDEN: number_words(100 * online["said_hidden"].mean(), 0),
                    "overlap, revised": number_words(revised["mean_overlap"].mean(), 3),
                    "overlap, online": number_words(online["mean_overlap"].mean(), 3),
                }
            )
    return text_table(
        "lights",
        "Experiment 1, another recording: complete occlusions, a lamp off and on again; scenes of "
        "which it is so, means over scenes. Revised boxes, and those said at once (online); said "
        "hidden: at once, of the frames that show 90 % of the target. The paper: tracked by "
        "invariants, lost at the change by intensity and RGB",
        data,
        n_labels=3,
    )


def choices_table(sets: pd.DataFrame) -> Table:
    """What each choice makes of clips and recording: readings of the text, and ablations.

    Parameters
    ----------
    sets : DataFrame
        See `set_table`.
    """
    data = []
    for features, definition, preset, variant, runs in _ways(sets):
        clips = runs[runs["sequence"] == CLIPS]
        lights = runs[(runs["sequence"] == LIGHTS) & (runs["trace"] == "revised")]
        revised, online = (clips[clips["trace"] == trace] for trace in ("revised", "online"))
        data.append(
            {
                "features": FEATURES[features, definition],
                "setting": setting(preset, variant),
                "clips tracked, revised": _spread(revised["tracked"]),
                "clips tracked, online": _spread(online["tracked"]),
                "occlusions detected, revised": _spread(revised["detected"]),
                "false ones a clip": number_words(revised["false_occlusions"].mean(), 2),
                "overlap, revised": number_words(revised["mean_overlap"].mean(), 3),
                "outliers [%]": number_words(100 * revised["outliers"].mean(), 1),
                "lights tracked, revised": _count(lights["tracked"]),
            }
        )
    return text_table(
        "choices",
        "What decides the outcome: choices that the text leaves open, and ablations, one at a "
        "time. Clips: means (ranges) over sets; lights: scenes. Traces are named in the heads",
        data,
        n_labels=2,
    )


def _ways(rows: pd.DataFrame) -> Iterator[tuple[str, str, str, str, pd.DataFrame]]:
    """Features, definition, preset, variant, and the rows that were run so."""
    for features, definition in FEATURES:
        chosen = rows[(rows["features"] == features) & (rows["definition"] == definition)]
        ways = chosen[["preset", "variant"]].drop_duplicates().itertuples(index=False, name=None)
        for preset, variant in sorted(ways, key=_order):
            yield (
                features,
                definition,
                preset,
                variant,
                chosen[(chosen["preset"] == preset) & (chosen["variant"] == variant)],
            )


def _order(way: tuple[str, str]) -> tuple[int, str, str]:
    return SETTINGS.index(way) if way in SETTINGS else len(SETTINGS), *way


def _spread(values: "pd.Series[float]") -> str:
    """Mean and range."""
    if values.empty:
        return MISSING
    return f"{values.mean():.1f} ({values.min():.0f}–{values.max():.0f})"


def _count(flags: "pd.Series[float] | pd.Series[bool]") -> str:
    return f"{flags.sum():.0f} of {len(flags)}" if len(flags) else MISSING
