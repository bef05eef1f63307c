"""What was measured on the scenes, in figures: maps, drift, starts beside the target, cameras."""

from collections.abc import Iterator, Mapping

import pandas as pd

from bench.papers.tables import number_words, text_table
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from reports.tables import Table

__all__ = ["camera_table", "scene_table"]

Tables = Mapping[str, pd.DataFrame]

COLUMNS = {"table-tennis": TABLE_TENNIS, "hand": HAND, "cup": CUP}


def scene_table(tables: Tables) -> Table:
    """Quantities that stand behind verdicts, a row each, means over scenes and frames.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        See `checks`; what is not there was not measured.
    """
    data = [
        {"claim": claim.upper(), "quantity": words}
        | {
            column: number_words(rows.loc[rows["sequence"] == sequence, metric].mean(), 2)
            for column, sequence in COLUMNS.items()
        }
        for claim, words, rows, metric in _quantities(tables)
    ]
    return text_table(
        "scenes",
        "What was measured on the scenes, as written where nothing else is said: means over "
        "scenes and frames",
        data,
        n_labels=2,
    )


def camera_table(tables: Tables) -> Table:
    """What the motion map says with a camera that moves, by sequence."""
    data = []
    if "camera" in tables:
        for (sequence, camera), rows in tables["camera"].groupby(
            ["sequence", "camera"], sort=False
        ):
            shares = {
                "pixels that change [%]": "changing",
                "called moving [%]": "moving",
                "of the window called moving [%]": "moving_inside",
            }
            data.append(
                {"sequence": str(sequence), "camera": str(camera)}
                | {words: f"{100 * rows[name].mean():.0f}" for words, name in shares.items()}
            )
    return text_table(
        "camera",
        "The motion map with a camera that moves: edges change all over the image, so that the "
        "adaptive threshold marks a few per cent wherever they are, and says nothing of the target",
        data,
        n_labels=2,
    )


def _quantities(tables: Tables) -> Iterator[tuple[str, str, pd.DataFrame, str]]:
    """Claim, what is measured in words, its rows and column."""
    if "wa-2" in tables:
        similar = tables["wa-2"][tables["wa-2"]["similar"] == 1.0]
        for name, rows in similar.groupby("map", sort=False):
            yield "wa-2", f"contrast before similar colours, {name}", rows, "contrast"
    if "wa-3" in tables:
        for name, rows in tables["wa-3"].groupby("map", sort=False):
            yield "wa-3", f"relative change of the map by gain, {name}", rows, "change"
    if "wa-4" in tables:
        for window, rows in tables["wa-4"].groupby("window"):
            yield "wa-4", f"of what moves is marked, n = {window}", rows, "recall"
            yield "wa-4", f"of what is marked moves, n = {window}", rows, "precision_swept"
    if "wa-5" in tables:
        slow = tables["wa-5"].query("step == 1 and noise == 0 and slow == 1")
        for number, rows in slow.groupby("differences", sort=False):
            told = f"{number} difference(s), the slower half of the frames"
            yield "wa-5", f"of what moves is marked, {told}", rows, "recall"
        noisy = tables["wa-5"].query("step == 1 and noise in (0, 8, 16)")
        for (differences, noise), rows in noisy.groupby(["differences", "noise"], sort=False):
            told = f"{differences} difference(s), noise {noise:g}"
            yield "wa-5", f"of what is marked moves or did, {told}", rows, "precision_swept"
    if "wa-6" in tables:
        adaptive = tables["wa-6"][tables["wa-6"]["rule"] == "adaptive"]
        for level, rows in adaptive.groupby("level"):
            yield "wa-6", f"F1 of the adaptive threshold, λ = {level:g}", rows, "f1"
        fixed = tables["wa-6"][tables["wa-6"]["rule"] == "fixed"]
        yield "wa-6", "F1 of the best fixed threshold", fixed[fixed["best"] == 1.0], "f1"
    if "wa-7" in tables:
        for name, rows in tables["wa-7"].groupby("map", sort=False):
            yield "wa-7", f"share of the map on the target, {name}", rows, "inside"
    if "wa-11" in tables:
        for (preset, stage), rows in tables["wa-11"].groupby(["preset", "stage"], sort=False):
            told = f"{stage}, {preset}"
            yield "wa-11", f"mean distance to the target [px], {told}", rows, "distance"
            yield "wa-11", f"spread of the particles [px], {told}", rows, "spread"
            if stage == "drifted":
                yield "wa-11", f"share of particles that gain by the drift, {preset}", rows, "risen"
    if "wa-28" in tables:
        starts = tables["wa-28"].groupby(["tracker", "preset", "widths"], sort=False)
        for (tracker, preset, widths), rows in starts:
            told = f"{tracker}, {preset}, {widths} widths beside".replace(", any", "")
            yield "wa-28", f"recovered in 20 frames, {told}", rows, "recovered"
