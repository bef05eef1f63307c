"""The units of evidence: sets of 20 clips, and scenes of the recording."""

from collections.abc import Mapping

import pandas as pd

from bench.papers.nguyen2002.scores import is_clip

__all__ = ["CLIPS", "N_CLIPS", "by_sets", "set_table"]

CLIPS = "nguyen2002/clips"
"""What the clips of a set are called together."""

N_CLIPS = 20

_LABELS = ["text", "features", "definition", "preset", "variant", "trace", "sequence", "scene"]
_SUMS = ["occlusions", "declared", "detected"]
_MEANS = ["false_occlusions", "on_target", "said_hidden", "mean_overlap", "jitter", "outliers"]


def set_table(scores: pd.DataFrame) -> pd.DataFrame:
    """Scores by set; a scene of the recording is a set of one.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`; a set of clips in which one failed, or is not there, is left out.

    Returns
    -------
    DataFrame
        What is known of tracker and trace, `sequence` (`nguyen2002/clips` for all clips), `scene`;
        `clips`, `tracked` (numbers), `tracked_share`; `occlusions`, `declared`, `detected`
        (numbers), `detected_share`; means over the clips: `false_occlusions`, `on_target`,
        `said_hidden`, `mean_overlap`, `jitter`, `outliers`; `path` (of one of the runs).
    """
    good = scores[scores["failure"] == ""]
    good = good.assign(sequence=[_together(name) for name in good["sequence"]])
    groups = good.groupby(_LABELS, sort=False)
    sets = groups["success"].agg(clips="size", tracked="sum").reset_index()
    sets = sets.join(groups[_SUMS].sum(), on=_LABELS).join(groups[_MEANS].mean(), on=_LABELS)
    sets = sets[(sets["sequence"] != CLIPS) | (sets["clips"] == N_CLIPS)]
    return sets.assign(
        tracked_share=sets["tracked"] / sets["clips"],
        detected_share=sets["detected"] / sets["occlusions"],
    ).reset_index(drop=True)


def by_sets(tables: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """The same tables, in which a set's clips have one name: they are not evidence one by one."""
    return {
        name: table.assign(sequence=[_together(sequence) for sequence in table["sequence"]])
        if "sequence" in table
        else table
        for name, table in tables.items()
    }


def _together(sequence: str) -> str:
    return CLIPS if is_clip(sequence) else sequence
