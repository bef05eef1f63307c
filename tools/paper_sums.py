"""Numbers of reproduced main results in the README, from the sum lines of the papers' pages.

python -m tools.paper_sums    # writes them into README.md
"""

import re
from pathlib import Path

from trackmark.bench.papers import SETTINGS

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
_ROW = re.compile(r"^(\| \[[^|]*\]\((docs/papers/\w+\.md)\)[^|]* \|).*$", re.M)
_NOT_COUNTED = re.compile(r"(\d+) by construction, (\d+) not testable here")


def sums(page: Path) -> list[str]:
    """Return the sum of each setting, such as `2 of 5 (3 by construction, …)`.

    A page without verdicts gives `not judged yet`.
    """
    content = page.read_text("utf-8")
    lines = [
        re.search(rf"^- {setting}: Main results reproduced: (.*)$", content, re.M)
        for setting in SETTINGS
    ]
    return [line[1] if line else "not judged yet" for line in lines]


def readme() -> str:
    """Return the README with the sums of all pages, shortened to `2 of 5 (3, 0)`."""

    def with_sums(row: re.Match[str]) -> str:
        cells = [_NOT_COUNTED.sub(r"\1, \2", cell) for cell in sums(ROOT / row[2])]
        return f"{row[1]} {' | '.join(cells)} |"

    return _ROW.sub(with_sums, README.read_text("utf-8"))


if __name__ == "__main__":
    README.write_text(readme(), "utf-8")
