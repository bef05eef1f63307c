"""Output and progress of commands in terminals and elsewhere."""

import io
import sys
import threading

import pytest

from trackmark.bench.commands import _progress
from trackmark.bench.commands._progress import patience, progress_bar
from trackmark.bench.commands._terminal import Outlet, complain, outlets
from trackmark.reports.printable import MAX_WIDTH, wrap


class Screen(io.StringIO):
    """A terminal or a pipe; `shown` is set when `text` is written."""

    def __init__(self, *, terminal, text="no text"):
        super().__init__()
        self.terminal, self.text, self.shown = terminal, text, threading.Event()

    def isatty(self):
        return self.terminal

    def write(self, text):
        written = super().write(text)
        if self.text in self.getvalue():
            self.shown.set()
        return written


@pytest.mark.parametrize("terminal", [True, False])
def test_long_message_is_wrapped_in_a_terminal_only(terminal, monkeypatch):
    screen = Screen(terminal=terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    message = "a-file.txt: " + "this is nothing that a reader knows; " * 10
    with outlets():
        complain(message)
    lines = screen.getvalue().splitlines()
    assert (max(map(len, lines)) <= MAX_WIDTH) == terminal
    assert (len(lines) == 1) != terminal
    assert " ".join(lines).split() == f"trackmark: {message}".split()


@pytest.mark.parametrize("command", [("list",), ("describe", "camshift"), ("doctor",)])
def test_listed_texts_fit_a_terminal(trackmark, command):
    assert max(map(len, trackmark(*command).stdout.splitlines())) <= MAX_WIDTH


def test_wrapped_text_is_indented_like_its_first_line():
    first, *others = wrap("  window=fixed   " + "what it means " * 20).splitlines()
    assert first.startswith("  window=fixed   what")
    assert others
    assert {len(line) - len(line.lstrip()) for line in others} == {17}


def test_outlet_of_a_closed_stream_closes_without_error():
    stream = io.TextIOWrapper(io.BytesIO())
    outlet = Outlet(stream)
    stream.close()
    outlet.close()  # what Python does when it deletes the outlet
    assert outlet.closed


class Lines(list):
    """Printed lines; `complete` is set when there are so many."""

    def __init__(self, number):
        super().__init__()
        self.number, self.complete = number, threading.Event()

    def print(self, line):
        self.append(line)
        if len(self) >= self.number:
            self.complete.set()


def test_long_work_is_named_once_and_repeatedly_in_a_terminal(monkeypatch):
    pipe, terminal = Lines(1), Lines(4)
    monkeypatch.setattr(_progress, "PATIENCE", 0.01)
    with patience("Opening", pipe.print):
        monkeypatch.setattr(sys, "stderr", Screen(terminal=True))
        with patience("Opening", terminal.print) as count:
            assert pipe.complete.wait(300)
            count(1, 3)
            assert terminal.complete.wait(300)
    assert pipe == ["Opening …"]
    assert terminal[-1] == "Opening: 1 of 3 …"


def test_wait_for_the_first_frame_is_named(monkeypatch):
    screen = Screen(terminal=False, text="Waiting for the first frame …")
    monkeypatch.setattr(_progress, "PATIENCE", 0.01)
    monkeypatch.setattr(sys, "stderr", screen)
    with progress_bar(2, "frame") as show:
        assert screen.shown.wait(300)
        show(1)


def test_terminal_shows_the_bar_instead_and_its_line_ends(monkeypatch):
    terminal = Screen(terminal=True, text="0/2")
    monkeypatch.setattr(_progress, "PATIENCE", 0.01)
    monkeypatch.setattr(_progress, "progress_outlet", lambda: terminal)
    with progress_bar(2, "frame"):
        assert terminal.shown.wait(300)
    assert terminal.getvalue().endswith("\n")
    assert "Waiting" not in terminal.getvalue()
