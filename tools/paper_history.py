"""Page with the histories of all papers, which their `notes.md` contain.

python -m tools.paper_history    # writes docs/papers/history.md
"""

from pathlib import Path

from trackmark.bench.papers import paper_names
from trackmark.bench.papers.sections import read_notes

PAGE = Path(__file__).parents[1] / "docs" / "papers" / "history.md"

INTRODUCTION = (
    "Scenes are drawn from the papers' text, and criteria on images and ground truth decide which "
    "scenes are used. Several scenes, claims and settings were changed after results had been "
    "seen. The papers' cells in the tables of verdicts were then put into the units of ours; tests "
    "and verdicts did not change. This page lists the changes of each paper. "
    "`python -m tools.paper_history` writes it from the files `notes.md` of the papers."
)


def page() -> str:
    """Return the page in Markdown; each paper has a heading to which its own page links."""
    parts = ["# History of the reproductions", INTRODUCTION]
    for paper in paper_names():
        parts += [f"## {paper}", read_notes(paper)["History"]]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
