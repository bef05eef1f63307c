"""The documentation site builds without network, and its links lead somewhere."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from urllib.parse import unquote, urlsplit

import pytest

import trackmark
from trackmark import datasets, trackers

ROOT = Path(__file__).parents[1]


class Page(HTMLParser):
    """Links, loaded files and anchors of one page."""

    def __init__(self, file):
        super().__init__()
        self.links, self.loaded, self.anchors = [], [], {""}
        self.feed(file.read_text("utf-8"))

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.anchors.add(attributes.get("id") or attributes.get("name") or "")
        if tag == "a" and "href" in attributes:
            self.links.append(attributes["href"])
        elif address := attributes.get("src") or (tag == "link" and attributes.get("href")):
            self.loaded.append(address)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the site in strict mode, which makes a broken link or an unlisted page an error."""
    pytest.importorskip("mkdocs", reason="`make docs` and `make test-full` install MkDocs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    return folder


@pytest.mark.slow
def test_site_links_and_anchors_exist(site):
    pages = {file: Page(file) for file in site.rglob("*.html")}
    assert len(pages) > 20
    for file, page in pages.items():
        if file.name == "404.html":  # its addresses start at the root of a server
            continue
        for link in page.links + page.loaded:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            assert target.is_file(), f"{file.name}: {link}"
            if target in pages:
                assert parts.fragment in pages[target].anchors, f"{file.name}: {link}"


@pytest.mark.slow
def test_site_loads_nothing_from_the_network(site):
    for file in site.rglob("*.html"):
        assert not [link for link in Page(file).loaded if urlsplit(link).netloc], file.name
    for file in site.rglob("*.css"):
        assert not re.search(r"url\([\"']?(?:https?:)?//", file.read_text("utf-8")), file.name


@pytest.mark.slow
def test_site_api_page_has_every_public_name(site):
    anchors = Page(site / "api.html").anchors
    documented = {name.rpartition(".")[2] for name in anchors if name.startswith("trackmark.")}
    for module in (trackmark, trackers, datasets):
        names = {n for n in module.__all__ if not isinstance(getattr(module, n), ModuleType)}
        assert not names - documented, module.__name__
