"""Table of data sets in docs/datasets.md: `python -m tools.layout_table` writes it."""

from pathlib import Path

from trackmark.datasets.layouts import Layout, layouts

PAGE = Path(__file__).parents[1] / "docs" / "datasets.md"
HEAD = "| data set | files | first pixel | no size means | further data |\n|---|---|---|---|---|"


def main() -> None:
    """Write the table into the page."""
    PAGE.write_text(updated(PAGE.read_text("utf-8")), encoding="utf-8")


def updated(page: str) -> str:
    """Return the page with the current table."""
    before, _, rest = page.partition(HEAD)
    _, _, after = rest.partition("\n\n")
    rows = [_row(layout) for layout in layouts().values() if not layout.reader]
    return before + "\n".join([HEAD, *sorted(rows, key=str.lower)]) + "\n\n" + after


def _row(layout: Layout) -> str:
    """Return the row of a layout."""
    files = layout.in_words.removesuffix(f" ({layout.title})")
    cells = [layout.title, files, str(layout.first_pixel), layout.zero, "; ".join(_further(layout))]
    return f"| {' | '.join(cells)} |"


def _further(layout: Layout) -> list[str]:
    """Return phrases on the data besides boxes."""
    names: dict[str, list[str]] = {meaning: [] for meaning in layout.flags.values()}
    for file, meaning in layout.flags.items():
        names[meaning].append(f"`{file.removeprefix('NAME/')}`")
    phrases = [f"{meaning}: {', '.join(files)}" for meaning, files in names.items()]
    if "absent" in layout.columns.split() or "present" in layout.columns.split():
        phrases.append("presence in each row")
    if layout.frames == "sparse":
        phrases.append("frames without a row are not annotated")
    if layout.json_keys:
        phrases.append("JSON")
    if layout.visibility:
        phrases.append(f"visibility: `{layout.visibility.removeprefix('NAME/')}`")
    if layout.option:
        phrases.append(f"`:{layout.option}={layout.values[1]}`")
    return phrases


if __name__ == "__main__":
    main()
