"""The paper's Table 1 with ours beside it, what decides the outcome, and the scenes."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from bench.papers.cells import failed_words, median_quartiles
from bench.papers.context import Context
from bench.papers.multipart.scenes import INITIAL, KEPT_SHARE
from bench.papers.tables import RunTable, text_table
from reports.tables import MISSING, Table

__all__ = ["published", "readings_table", "scene_table", "table_1"]

METRICS = {
    "success_frames": "frames with overlap ≥ 0.5",
    "frames_inside": "frames with the centre inside the person",
    "first_loss": "frames before the first loss",
}
"""Three readings of "numbers of frames of tracking successfully"; `bench.claims.conclusion` says
which of them decide."""

LIGHTS = ("even", "dappled")
REPRESENTATIONS = ("single", "multi", "adaptive")
HEADS = (
    *("sequence", "frames"),
    *("single", "multi", "adaptive"),  # the paper's: a hundred columns hold no longer heads
    *("ours: single", "ours: multi", "ours: adaptive"),
)
"""Of Table 1: the paper's, and ours."""

TWO_COLOURED = tuple(f"multipart/{number}" for number in (1, 2, 5, 6))
PLAIN = tuple(f"multipart/{number}" for number in (3, 4, 7, 8))
"""Sequences by their target: shirt and trousers differ in colour, or do not."""

GROUPS = {"all": TWO_COLOURED + PLAIN, "two colours": TWO_COLOURED, "plain": PLAIN}


def _printed() -> pd.DataFrame:
    """The paper's Table 1: `sequence`, `frames`, and counts by representation."""
    table = pd.read_csv(Path(__file__).with_name("table-1.csv"))
    return table.assign(sequence="multipart/" + table["sequence"].astype(str))


def _written(context: Context, light: str) -> pd.DataFrame:
    """Runs as the text is read at its headline, in one light, on scenes that the gate keeps."""
    found = [
        context.lookup.runs("multipart", {"init": "full", "representation": one}, GROUPS["all"])
        for one in REPRESENTATIONS
    ]
    runs = pd.concat(found)
    return runs[(runs["light"] == light) & runs["kept_scene"]]


def table_1(context: Context) -> list[Table]:
    """Table 1 as the paper prints it, ours beside it: a table a light and metric."""
    tables = list[Table]()
    for light in LIGHTS:
        runs = _written(context, light)
        scenes = runs.groupby("sequence")["scene"].nunique().max()
        for metric, words in METRICS.items() if len(runs) else ():
            data = [_row(runs, metric, line) for line in _printed().to_dict("records")]
            data += [_group_row(runs, metric, group) for group in GROUPS]
            caption = (
                f"Table 1, other videos, {light} light: {words} (the paper's first: one run on its "
                f"own video; ours: median [quartiles] over {scenes} scenes that pass the static "
                "gate, and their repetitions; groups, of which 1, 2, 5 and 6 have two colours: "
                "share of the length, each sequence counting once)"
            )
            name = f"table-1-{metric.replace('_', '-')}-{light}"
            table = replace(text_table(name, caption, data, n_labels=1), heads=[*HEADS])
            tables.append(RunTable(**vars(table), runs=_behind(runs)))
    return tables


def _behind(runs: pd.DataFrame) -> list[list[Collection[str]]]:
    """Files of the runs behind the cells of Table 1; the paper's own have none."""
    together = [[line["sequence"]] for line in _printed().to_dict("records")]
    return [
        [()] * (1 + len(REPRESENTATIONS))
        + [
            set(runs.loc[runs["sequence"].isin(names) & (runs["representation"] == one), "path"])
            for one in REPRESENTATIONS
        ]
        for names in [*together, *GROUPS.values()]
    ]


def published(context: Context) -> list[dict[str, Any]]:
    """Table 1 for scripts: a published number a row, ours beside it."""
    rows = []
    for light in LIGHTS:
        runs = _written(context, light)
        for metric in METRICS if len(runs) else ():
            for line in _printed().to_dict("records"):
                for name in REPRESENTATIONS:
                    here = _of(runs, line["sequence"], name)
                    values = here.iloc[:0][metric] if failed_words(here) else here[metric]
                    quartiles = [float(values.quantile(q)) for q in (0.25, 0.75)]
                    rows.append(
                        {
                            "table": f"1:{metric}:{light}",
                            "label": f"sequence {line['sequence'].removeprefix('multipart/')}",
                            "column": name,
                            "published": line[name],
                            "measured": float(values.median()) if len(values) else None,
                            "interval": quartiles if len(values) else None,
                        }
                    )
    return rows


def _of(runs: pd.DataFrame, sequence: str, representation: str) -> pd.DataFrame:
    return runs[(runs["sequence"] == sequence) & (runs["representation"] == representation)]


def _row(runs: pd.DataFrame, metric: str, line: Mapping[Any, Any]) -> dict[str, str]:
    row = {"sequence": line["sequence"].removeprefix("multipart/"), "frames": str(line["frames"])}
    row |= {f"paper {name}": str(line[name]) for name in REPRESENTATIONS}
    return row | {
        f"ours {name}": median_quartiles(_of(runs, line["sequence"], name), metric, digits=0)
        for name in REPRESENTATIONS
    }


def _group_row(runs: pd.DataFrame, metric: str, group: str) -> dict[str, str]:
    """Share of the length, averaged over a group of sequences: the paper's, and ours."""
    printed = _printed()
    printed = printed[printed["sequence"].isin(GROUPS[group])]
    row = {"sequence": group, "frames": str(printed["frames"].sum())}
    for name in REPRESENTATIONS:
        row[f"paper {name}"] = f"{100 * (printed[name] / printed['frames']).mean():.1f} %"
    here = runs[runs["sequence"].isin(GROUPS[group])]
    for name in REPRESENTATIONS:
        chosen = here[here["representation"] == name]
        # A scene's repetitions first, so that each scene counts once.
        scenes = (chosen[metric] / chosen["frames"]).groupby([chosen["sequence"], chosen["scene"]])
        share = scenes.mean().groupby("sequence").mean().mean()
        told = f"{100 * share:.1f} %" if len(chosen) else MISSING
        row[f"ours {name}"] = failed_words(chosen) or told
    return row


def readings_table(context: Context) -> Table:
    """What decides the outcome: one row a reading of the text and light.

    Scenes that the gate drops have rows of their own. Those in which a run failed are left out, and
    counted.
    """
    runs = context.scores[context.scores["sequence"].isin(GROUPS["all"])]
    parameters = [key for key in context.lookup.parameters("multipart") if key != "representation"]
    data = []
    for _, every in runs.groupby([*parameters, "init", "light", "kept_scene"], sort=False):
        failed = every[every["failure"] != ""][["sequence", "scene"]].drop_duplicates()
        cells = pd.MultiIndex.from_frame(every[["sequence", "scene"]])
        whole = every[~cells.isin(pd.MultiIndex.from_frame(failed))]
        data.append(_reading_row(context, whole, every.iloc[0], len(failed)))
    caption = (
        "What decides the outcome: readings of what the paper leaves open. Differences and shares "
        "in % of the length, means over scenes; `kept` is the share before the first loss. The "
        "body rectangle and uv ranges fitted to natural colours are post hoc readings"
    )
    return text_table("readings", caption, data, n_labels=3)


def _reading_row(
    context: Context, runs: pd.DataFrame, run: "pd.Series[Any]", left_out: int
) -> dict[str, str]:
    first = runs.groupby(["sequence", "scene"], as_index=False).first()
    right = (first["part_distance"] > first["threshold"]) == first["sequence"].isin(TWO_COLOURED)
    told = context.wording.setting(run["text"], ["representation", "init"])
    row = {
        "reading": "as written" if told == MISSING else told,
        "rectangle": INITIAL[run["init"]],
        "light": run["light"]
        + ("" if run["kept_scene"] else ", scenes that the gate drops")
        + (f", {left_out} scenes left out" if left_out else ""),
        "right picks": f"{right.sum()} of {len(right)}",
    }
    for words, sequences in (("two colours", TWO_COLOURED), ("plain", PLAIN)):
        for metric in ("frames_inside", "first_loss"):
            shares = _cell_shares(runs[runs["sequence"].isin(sequences)], metric)
            gain = 100 * (shares["multi"] - shares["single"]).mean()
            row[f"multi − single, {words}, {metric.replace('_', ' ')}"] = f"{gain:+.1f}"
    shares = _cell_shares(runs, "first_loss")
    return row | {f"kept, {name}": f"{100 * shares[name].mean():.1f}" for name in REPRESENTATIONS}


def _cell_shares(runs: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Share of the length by (sequence, scene) and representation, averaged over repetitions."""
    shares = runs.assign(share=runs[metric] / runs["frames"])
    wide = shares.pivot_table("share", ["sequence", "scene"], "representation", aggfunc="mean")
    return wide.reindex(columns=list(REPRESENTATIONS))


def scene_table(context: Context) -> Table:
    """Which scenes the static gate kept, and what the switch says of their first frames."""
    scenes = context.tables["static"]
    data = [
        {
            "scene": scene["name"],
            "single": f"{100 * scene['single']:.0f} %",
            "multi": f"{100 * scene['multi']:.0f} %",
            "kept": "yes" if scene["kept_scene"] else "no",
        }
        | {
            f"d {one}": f"{scene[f'distance_{one}']:.3f} ({100 * scene[f'multi_{one}']:.0f} %)"
            for one in INITIAL.values()
        }
        for scene in scenes.to_dict("records")
    ]
    caption = (
        f"Scenes, examined before any tracker ran: {scenes['kept_scene'].sum()} of {len(scenes)} "
        "are kept. Share of frames in which the true box is nearer to the model than the best "
        f"clutter within three widths (kept from {100 * KEPT_SHARE:.0f} % by the better); d[p1, "
        "p2] of the first rectangle, and in how many of 200 jittered by 5 % it is above 0.4"
    )
    return text_table("static", caption, data, n_labels=1)
