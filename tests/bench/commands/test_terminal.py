"""What a terminal is given."""

import io
import sys

import pytest

from trackmark.bench.commands._terminal import Outlet, complain, outlets
from trackmark.reports.printable import WIDTH, wrapped


class Screen(io.StringIO):
    """A terminal, or a pipe."""

    def __init__(self, *, terminal):
        super().__init__()
        self._terminal = terminal

    def isatty(self):
        return self._terminal


@pytest.mark.parametrize("terminal", [True, False])
def test_a_long_message_has_lines_of_its_width_and_in_a_pipe_a_line(terminal, monkeypatch):
    screen = Screen(terminal=terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    message = "a-file.txt: " + "this is nothing that a reader knows; " * 10
    with outlets():
        complain(message)
    lines = screen.getvalue().splitlines()
    assert (max(map(len, lines)) <= WIDTH) == terminal
    assert (len(lines) == 1) != terminal
    assert " ".join(lines).split() == f"trackmark: {message}".split()


@pytest.mark.parametrize("command", [("list",), ("describe", "camshift"), ("doctor",)])
def test_what_is_listed_stays_beside_its_name_where_it_takes_several_lines(trackmark, command):
    lines = trackmark(*command).stdout.splitlines()
    assert max(map(len, lines)) <= WIDTH


def test_what_takes_several_lines_stays_beside_its_label():
    first, *others = wrapped("  window=fixed   " + "what it means " * 20).splitlines()
    assert first.startswith("  window=fixed   what")
    assert others
    assert {len(line) - len(line.lstrip()) for line in others} == {17}


def test_outlet_of_a_closed_stream_closes_without_error():
    stream = io.TextIOWrapper(io.BytesIO())
    outlet = Outlet(stream)
    stream.close()
    outlet.close()  # what Python does when it deletes the outlet
    assert outlet.closed
