"""The browser that tests of pages share."""

import pytest

from tests import browser


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    opened = browser.Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()
