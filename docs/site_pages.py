"""Hook of MkDocs: adds pages outside `docs/`, the font and the Python API to the site."""

import posixpath
import re
from pathlib import Path
from types import ModuleType
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

import trackmark
from trackmark import datasets, trackers
from trackmark.bench import metrics
from trackmark.bench.papers.real_video import FILE, read_scores, stale_trackers

ROOT = Path(__file__).parents[1]
FONT = ROOT / "bench/pages/templates/inter.woff2"
ROOT_PAGES = {
    "README.md": "index.md",
    "ARCHITECTURE.md": "architecture.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
"""Pages outside `docs/`, with their names on the site."""

API = {
    "trackmark": (trackmark, "Run trackers, score them and read results."),
    "trackmark.trackers": (trackers, "Create trackers and write your own."),
    "trackmark.datasets": (datasets, "Load sequences."),
    "trackmark.metrics": (metrics, "List and describe definitions of scores."),
}


def on_pre_build(config: Any) -> None:
    """Raise `PluginError` if the scores on real video are of other versions than the present."""
    if stale := stale_trackers(read_scores()):
        raise PluginError(
            f"{FILE}: scores are of earlier versions of {', '.join(stale)}, or of their sequences. "
            "Run: python -m tools.real_video FOLDER --write, with the sequences of OTB in FOLDER."
        )


def on_files(files: Files, config: Any) -> Files:
    """Add the pages and the font that are not in `docs/`."""
    for source, name in ROOT_PAGES.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text("utf-8")))
    files.append(File.generated(config, "api.md", content=_api_page()))
    files.append(File.generated(config, "assets/inter.woff2", abs_src_path=str(FONT)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Point the links between pages to their names on the site."""
    name = page.file.src_uri
    source = {site: root for root, site in ROOT_PAGES.items()}.get(name, f"docs/{name}")
    folder = posixpath.dirname(source)

    def replace(match: re.Match[str]) -> str:
        text, target, anchor = match["text"], match["target"], match["anchor"] or ""
        if target.startswith("http"):
            return match.group()
        path = posixpath.normpath(posixpath.join(folder, target))
        new = ROOT_PAGES.get(path, path.removeprefix("docs/"))
        if new == path:  # a file of the repository that the site does not have
            return text.removeprefix("[").removesuffix("]")
        return f"{text}({posixpath.relpath(new, posixpath.dirname(name) or '.')}{anchor})"

    return re.sub(
        r"(?P<text>\[[^\]]*\])\((?P<target>[^)#\s]+)(?P<anchor>#[^)]*)?\)", replace, markdown
    )


def _api_page() -> str:
    """Return a page with a directive of mkdocstrings for every public name."""
    lines = [
        "# Python API",
        "",
        "Every public name of `import trackmark`. [trackmark from Python](python.md) has examples.",
    ]
    documented: list[Any] = []
    for module_name, (module, purpose) in API.items():
        lines += ["", f"## {module_name}", "", purpose]
        for name in module.__all__:
            value = getattr(module, name)
            if not isinstance(value, ModuleType) and all(
                value is not other for other in documented
            ):
                lines.append(f"\n::: {module.__name__}.{name}")
                documented.append(value)
    return "\n".join([*lines, ""])
