"""Scores of trackers on recorded sequences of OTB, and the pages that show them.

python -m tools.real_video FOLDER --write    # FOLDER contains the sequences of OTB, at any depth
python -m tools.real_video --write           # pages only, from the stored scores

With FOLDER, missing runs are executed and stored in `--results-root`; `--write` then replaces
`bench/papers/real_video.csv`. `opencv-csrt` needs the package opencv-contrib-python-headless.
"""

import argparse
import re
import sys
from collections.abc import Sequence
from functools import cache, partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import rankdata

import trackmark as tm
from trackmark.bench.papers import paper_names
from trackmark.bench.papers.markdown_page import section_text
from trackmark.bench.papers.paper import read_paper
from trackmark.bench.papers.real_video import (
    FILE,
    HEADINGS,
    OTB,
    STALE,
    STALE_NOTE,
    ranked_rows,
    read_scores,
    score_cells,
    stale_trackers,
    tracker_state,
    with_published_scores,
)
from trackmark.bench.papers.sections import REAL_VIDEO, real_video_section
from trackmark.bench.statistics.intervals import Interval
from trackmark.reports.renderers import to_markdown
from trackmark.reports.tables import Table, text_table

DOCS = Path(__file__).parents[1] / "docs"
PAGE = DOCS / "real-video.md"

TRACKERS = (
    *("nummiaro2003:preset=as-written", "nummiaro2003", "nummiaro2003:preset=robust"),
    *("moreno2005:preset=as-written", "moreno2005"),
    *("contour-smooth-color:preset=as-written", "contour-smooth-color"),
    *("wang2010:preset=as-written", "wang2010", "camshift", "camshift-improved"),
    *("particle-filter:preset=as-written", "particle-filter"),
    *("nguyen2002:preset=as-written", "nguyen2002"),
    *("nguyen2002:preset=as-written:features=rgb", "nguyen2002:features=rgb"),
    *("multipart", "multipart:preset=robust", "mean-shift", "mean-shift-kalman"),
    *("opencv-mil", "opencv-csrt", "static"),
)
"""Trackers of the papers in both settings, unless these are equal, and trackers to compare with."""

SEQUENCES = (
    *("Bird1", "Bird2", "Bolt2", "Couple", "Crossing", "Dancer2", "Deer", "Diving", "Dog", "Dog1"),
    *("DragonBaby", "Football1", "Freeman1", "Girl", "Human7", "Jumping", "Man", "MotorRolling"),
    *("MountainBike", "Skiing", "Suv"),
)
"""Sequences of OTB."""

SCENE_TRACKERS = tuple(name for name in TRACKERS if not name.startswith("opencv-"))
"""Trackers on scenes. OpenCV's are omitted: they take as much time as all others together."""

SCENES = (
    *(f"moreno2005/{name}" for name in ("ellipse:scene=200", "octopus:scene=400")),
    *(f"moreno2005/{name}" for name in ("book:scene=200", "leaf:scene=300")),
    *(f"multipart/{number}:scene=400" for number in (5, 6, 7, 8)),
    *(f"nguyen2002/clip-{number}:scene=400" for number in ("01", "08", "13", "15")),
    *(f"nummiaro2003/{name}" for name in ("person:scene=200", "car:scene=200")),
    *(f"nummiaro2003/{name}" for name in ("students:scene=200", "traffic:scene=400")),
    *(f"wang2010/{name}" for name in ("table-tennis:scene=200", "hand:scene=400", "cup:scene=200")),
)
"""First scene that meets the criteria, of the four shortest sequences of each paper."""

PUBLISHED = tuple(
    f"{name} (published)"
    for name in ("MUSTer", "MEEM", "STRUCK", "SCM", "CXT", "CPF", "KMS", "FRAG", "IVT", "MIL")
)
"""Published trackers on the page: the best five on all of OTB-100, and relatives of ours."""

COLUMNS = (
    *("nummiaro2003", "moreno2005", "wang2010", "nguyen2002", "multipart", "mean-shift", "static"),
    "STRUCK (published)",
)
"""Trackers in the table of single sequences."""

SCORES = ["mean_overlap", "success_rate", "ms_per_frame"]
RESAMPLES = 2000


def find_sequences(folder: Path) -> list[Path]:
    """Return the folders of `SEQUENCES`; raise `SystemExit` with the names of missing ones."""
    folders = {file.parent.name: file.parent for file in folder.rglob("groundtruth_rect.txt")}
    if missing := [name for name in SEQUENCES if name not in folders]:
        raise SystemExit(f"{folder}: {', '.join(missing)} not found. Add these folders of OTB.")
    return [folders[name].absolute() for name in SEQUENCES]


def measure(folder: Path, root: Path, jobs: int) -> pd.DataFrame:
    """Execute missing runs; return the scores as `read_scores` does."""
    run = partial(tm.run, metrics="otb", jobs=jobs)
    recorded = run(list(TRACKERS), find_sequences(folder), root / "recorded")
    scenes = run(list(SCENE_TRACKERS), list(SCENES), root / "scenes")
    rows = pd.concat(
        [score_rows(recorded, TRACKERS, SEQUENCES), score_rows(scenes, SCENE_TRACKERS, SCENES)],
        ignore_index=True,
    )
    return rows.assign(parameters=rows["parameters"].mask(rows["tracker"].duplicated()))


def score_rows(runs: tm.Runs, trackers: Sequence[str], sequences: Sequence[str]) -> pd.DataFrame:
    """Return one row per tracker and sequence; a failed run has the worst scores."""
    scored = runs.scored()
    scored = scored[scored["status"].isin(["finished", "failed"])]
    rows = []
    states = {tracker: tracker_state(tracker) for tracker in trackers}
    for tracker, sequence in product(trackers, sequences):
        (run,) = scored[(scored["tracker"] == tracker) & (scored["sequence"] == sequence)].to_dict(
            "records"
        )
        version, parameters = states[tracker]
        rows.append(
            {
                "data": sequence.rpartition("/")[0] or OTB,
                "tracker": tracker,
                "version": version,
                "parameters": parameters,
                "sequence": sequence,
                "fingerprint": run["fingerprint"][:16],
                "grey": is_grey(run["source"]),
                **{name: run[name] for name in SCORES},
            }
        )
    return pd.DataFrame(rows)


@cache
def is_grey(sequence: str) -> bool:
    """Return whether the first image of a sequence is grey."""
    return bool((np.ptp(tm.datasets.load(sequence).frames[0], axis=2) == 0).all())


def rank_agreement(video: pd.DataFrame, scenes: pd.DataFrame) -> tuple[float, Interval]:
    """Return Spearman's correlation of trackers' means on video and scenes, with its interval.

    Each paper has the same weight. The 95 % interval is a percentile bootstrap: both the sequences
    of OTB and the scenes of each paper are drawn with replacement.
    """
    samples = [
        rows.pivot_table("mean_overlap", "tracker", "sequence").loc[list(SCENE_TRACKERS)].to_numpy()
        for rows in (video, *(rows for _, rows in scenes.groupby("data")))
    ]

    generator = np.random.default_rng(0)
    sizes = [sample.shape[1] for sample in samples]
    drawn = [generator.integers(size, size=(RESAMPLES, size)) for size in sizes]
    low, high = np.nanquantile(_correlations(samples, drawn), [0.025, 0.975])
    (agreement,) = _correlations(samples, [np.arange(size)[None] for size in sizes])
    return float(agreement), Interval(float(low), float(high))


def _correlations(
    samples: Sequence[NDArray[np.float64]], drawn: Sequence[NDArray[np.int64]]
) -> NDArray[np.float64]:
    """Return Spearman's correlation of the first sample with the mean of the others, per draw.

    `samples`: shapes (trackers, n). `drawn`: indices of the sequences, shapes (draws, n).
    """
    means = [
        sample[:, indices].mean(axis=2) for sample, indices in zip(samples, drawn, strict=True)
    ]
    ranks = rankdata([means[0], np.mean(means[1:], axis=0)], axis=1)
    first, second = ranks - ranks.mean(axis=1, keepdims=True)
    norms = np.sqrt((first**2).sum(axis=0) * (second**2).sum(axis=0))
    result: NDArray[np.float64] = (first * second).sum(axis=0) / norms
    return result


def blocks(scores: pd.DataFrame) -> dict[str, str]:
    """Return the texts that the page contains between comments, by name."""
    rows, ranked = with_published_scores(scores)
    listed = rows[rows["tracker"].isin([*TRACKERS, *PUBLISHED])]
    stale = stale_trackers(scores)
    scenes = scores[scores["data"] != OTB]
    return {
        "answer": answer(rows),
        "means": to_markdown(mean_table(listed, stale)),
        "sequences": to_markdown(sequence_table(rows, stale)),
        "ranks": to_markdown(rank_table(scores[scores["data"] == OTB], scenes)),
        "published": to_markdown(published_table(rows, ranked)),
    }


def published_table(rows: pd.DataFrame, ranked: Sequence[str]) -> Table:
    """Return all published trackers with their means, best first, ten in a row."""
    means = rows.groupby("tracker")["mean_overlap"].mean()
    cells = [f"{label.removesuffix(' (published)')} {means[label]:.2f}" for label in ranked]
    starts = range(0, len(cells), 10)
    lines = [[f"from {start + 1}", ", ".join(cells[start : start + 10])] for start in starts]
    caption = f"All {len(cells)} published trackers on these sequences, best first"
    return text_table("published", caption, ["rank", "trackers"], lines, 2)


def answer(rows: pd.DataFrame) -> str:
    """Return which trackers have the highest means, and the range of the trackers of papers."""
    means = rows.groupby("tracker")["mean_overlap"].mean().sort_values(ascending=False)
    ours = [name for name in means.index if name in TRACKERS]
    of_papers = [name for name in ours if not name.startswith(("opencv-", "mean-shift", "static"))]
    best, *_, last = of_papers
    n_better = int((means[[name for name in means.index if name not in ours]] > means[best]).sum())
    return (
        f"**The best tracker of a paper is `{best}`, with a mean overlap of {means[best]:.2f} on "
        f"{rows['sequence'].nunique()} sequences of OTB**. {n_better} of "
        f"{len(means) - len(ours)} published trackers have a higher one, up to "
        f"{means.drop(ours).max():.2f}. `{ours[0]}` is the best of all trackers in trackmark "
        f"({means[ours[0]]:.2f}). The lowest of a paper is {means[last]:.2f}, for `{last}`; "
        f"`static` has {means['static']:.2f}."
    )


def mean_table(rows: pd.DataFrame, stale: list[str]) -> Table:
    """Return the means of all trackers, the best first, also on colour and grey sequences."""
    cells = []
    for tracker, group in ranked_rows(rows):
        parts = [group["mean_overlap"][group["grey"] == grey].mean() for grey in (False, True)]
        label, mean, interval, *others = score_cells(tracker, group, stale)
        cells.append([label, mean, interval, *(f"{part:.2f}" for part in parts), *others])
    grey = rows.groupby("sequence")["grey"].first()
    headings = [*HEADINGS[:3], "colour", "grey", *HEADINGS[3:]]
    caption = (
        f"Means over {len(grey)} sequences, and over those in colour and in grey, which are "
        f"{', '.join(grey.index[grey])}. Published trackers have neither success nor time."
    )
    return text_table("means", caption, headings, cells, notes=[STALE_NOTE] if stale else [])


def sequence_table(rows: pd.DataFrame, stale: list[str]) -> Table:
    """Return the mean overlap by sequence, grey sequences last."""
    overlaps = rows.pivot_table("mean_overlap", ["grey", "sequence"], "tracker").reset_index()
    cells = [
        [
            f"{row['sequence']} (grey)" if row["grey"] else str(row["sequence"]),
            *(f"{row[name]:.2f}" for name in COLUMNS),
        ]
        for row in overlaps.to_dict("records")
    ]
    headings = ["sequence", *(f"{name} {STALE}" if name in stale else name for name in COLUMNS)]
    return text_table("sequences", "Mean overlap by sequence", headings, cells)


def rank_table(video: pd.DataFrame, scenes: pd.DataFrame) -> Table:
    """Return the rank correlation of all scenes and of each paper's scenes with the video."""
    parts = [("all five papers", scenes), *scenes.groupby("data")]
    cells = []
    for name, rows in parts:
        correlation, (low, high) = rank_agreement(video, rows)
        n_scenes = str(rows["sequence"].nunique())
        cells.append([str(name), n_scenes, f"{correlation:.2f}", f"[{low:.2f}, {high:.2f}]"])
    caption = (
        f"Rank correlation of the means of {len(SCENE_TRACKERS)} trackers on scenes and on video"
    )
    headings = ["scenes of", "number of scenes", "Spearman's correlation", "95 %"]
    return text_table("ranks", caption, headings, cells)


def page(markdown: str, scores: pd.DataFrame) -> str:
    """Return the page with the texts of `blocks` between their comments."""
    texts = blocks(scores)
    return re.sub(
        r"<!-- (\w+) -->\n.*?\n<!-- end -->",
        lambda match: f"<!-- {match[1]} -->\n\n{texts[match[1]].strip()}\n\n<!-- end -->",
        markdown,
        flags=re.S,
    )


def paper_page(markdown: str, paper: str) -> str:
    """Return the page of a paper with the present section on real video."""
    section = section_text(real_video_section(read_paper(paper)))
    pattern = rf"\n## {REAL_VIDEO}\n.*?(?=\n## )|(?=\n## From the text to the default\n)"
    return re.sub(pattern, lambda _: f"\n{section}\n", markdown, count=1, flags=re.S)


def pages() -> dict[Path, str]:
    """Return the pages with the stored scores by file."""
    papers = {DOCS / "papers" / f"{paper}.md": paper for paper in paper_names()}
    return {
        PAGE: page(PAGE.read_text("utf-8"), read_scores()),
        **{file: paper_page(file.read_text("utf-8"), paper) for file, paper in papers.items()},
    }


def main() -> None:
    """Execute missing runs, write scores and pages, and print the tables of the page."""
    parser = argparse.ArgumentParser(prog="python -m tools.real_video")
    parser.add_argument("folder", type=Path, nargs="?", help="folder with the sequences of OTB")
    parser.add_argument("--jobs", type=int, help="worker processes; one per core by default")
    parser.add_argument("--results-root", type=Path, default=Path("out/real-video"))
    parser.add_argument("--write", action="store_true", help="write scores and pages")
    arguments = parser.parse_args()
    scores = read_scores() if arguments.folder is None else measure(
        arguments.folder, arguments.results_root.absolute(), arguments.jobs
    )  # fmt: skip
    sys.stdout.write("\n".join(blocks(scores).values()) + "\n")
    if arguments.write:
        scores.to_csv(FILE, index=False, float_format="%.6g", lineterminator="\n")
        for file, text in pages().items():
            file.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
