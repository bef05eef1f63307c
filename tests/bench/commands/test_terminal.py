"""Output and progress of commands in terminals and elsewhere."""

import ctypes
import fcntl
import io
import logging
import os
import pty
import re
import signal
import struct
import sys
import termios
import threading
import time
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import click
import pytest

from tests.bench.commands.conftest import masked
from trackmark.bench.commands import _progress
from trackmark.bench.commands._progress import (
    RunProgress,
    command_messages,
    progress_bar,
    report_slow_work,
)
from trackmark.bench.commands._terminal import (
    SafeStream,
    interruptible,
    print_error,
    print_result,
    safe_streams,
)
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
    with safe_streams():
        print_error(message)
    lines = screen.getvalue().splitlines()
    assert (max(map(len, lines)) <= MAX_WIDTH) == terminal
    assert (len(lines) == 1) != terminal
    assert " ".join(lines).split() == f"trackmark: {message}".split()


@pytest.mark.parametrize("program", ["trackmark", "../.venv/bin/trackmark", "python -m trackmark"])
def test_command_to_copy_is_not_wrapped(program, monkeypatch):
    screen = Screen(terminal=True)
    monkeypatch.setattr(sys, "stderr", screen)
    line = f"        {program} run --sequences " + " ".join(f"samples/{i}" for i in range(40))
    with safe_streams():
        click.echo(line, err=True)
    assert screen.getvalue() == line + "\n"


@pytest.mark.parametrize("command", [("list",), ("describe", "camshift"), ("doctor",)])
def test_listed_texts_fit_a_terminal(trackmark, command):
    lines = trackmark(*command).stdout.splitlines()
    assert max(len(line) for line in lines if "/" not in line) <= MAX_WIDTH  # apart from paths


RESULT = [
    "1 of 2 runs FAILED:",
    "",
    "a is better than b:",
    "0.7 against 0.6. It leads.",
    "Details.",
    "",
    "pair   decision",
    "a - b  better",
    "b - a  worse  0.1",
    "a - c  not worse",
    "\x1b[2J",
]


def printed_result(monkeypatch, *, terminal, no_colour):
    screen = Screen(terminal=terminal)
    monkeypatch.setattr(sys, "stdout", screen)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("NO_COLOR", no_colour)
    with safe_streams():
        print_result(RESULT)
    return screen.getvalue()


def test_answer_and_decisions_are_coloured_in_a_terminal(monkeypatch):
    text = printed_result(monkeypatch, terminal=True, no_colour="")
    red, green, bold, end = "\x1b[31m", "\x1b[32m", "\x1b[1m", "\x1b[0m"
    assert text.splitlines() == [
        f"{red}1 of 2 runs FAILED:{end}",
        "",
        f"{bold}a is better than b:",
        f"0.7 against 0.6. It leads.{end}",
        "Details.",
        "",
        "pair   decision",
        f"a - b  {green}better{end}",
        f"b - a  {red}worse{end}  0.1",
        "a - c  not worse",
        r"\u001b[2J",
    ]


@pytest.mark.parametrize(("terminal", "no_colour"), [(False, ""), (True, "1")])
def test_no_colours_without_terminal_or_with_no_color(monkeypatch, terminal, no_colour):
    text = printed_result(monkeypatch, terminal=terminal, no_colour=no_colour)
    assert text.splitlines() == [*RESULT[:-1], r"\u001b[2J"]


def test_wrapped_text_is_indented_like_its_first_line():
    first, *others = wrap("  window=fixed   " + "what it means " * 20).splitlines()
    assert first.startswith("  window=fixed   what")
    assert others
    assert {len(line) - len(line.lstrip()) for line in others} == {17}


def test_safe_stream_of_a_closed_stream_closes_without_error():
    stream = io.TextIOWrapper(io.BytesIO())
    safe = SafeStream(stream)
    stream.close()
    safe.close()  # what Python does when it deletes a stream
    assert safe.closed


@pytest.fixture
def screen(monkeypatch):
    """Return a function that replaces standard error; progress is shown without delay."""

    def replaced(**options):
        new = Screen(**options)
        monkeypatch.setattr(sys, "stderr", new)
        return new

    monkeypatch.setattr(_progress, "NOTICE_DELAY", 0.01)
    monkeypatch.setattr(_progress, "INTERVAL", 0.01)
    monkeypatch.setattr(_progress, "_MIN_SECONDS", 0.0)
    monkeypatch.setattr(_progress._Screen, "announced", set())
    return replaced


@pytest.mark.parametrize("terminal", [True, False])
def test_long_work_is_named_with_its_progress(screen, terminal):
    screen = screen(terminal=terminal, text="Opening: 1 of 3 …")
    with report_slow_work("Opening") as count:
        count(1, 3)
        assert screen.shown.wait(300)
    start = "" if terminal else r"\d\d:\d\d:\d\d wait     "
    assert re.match(f"{start}Opening(: 1 of 3)? …\n", screen.getvalue())


def test_bar_replaces_lines_in_a_terminal_and_its_line_ends(screen):
    screen = screen(terminal=True, text="Drawing")
    with progress_bar("Drawing", 2, "frame") as show:
        show(2)
    assert screen.getvalue() == "" or screen.getvalue().endswith("\n")


ROWS = [
    {"tracker": "a", "sequence": "cup", "status": status, "failure": failure}
    for status, failure in (
        ("finished", ""),
        ("failed", "0004.png: ValueError: empty\ntraceback"),
        ("failed", "0004.png: ValueError: empty\ntraceback"),
    )
]


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_of_runs_is_a_bar_or_complete_lines(screen, terminal):
    screen = screen(terminal=terminal, text="left")
    execution = SimpleNamespace(tasks=SimpleNamespace(n_runs=3, work=30))
    with RunProgress("two: 1 tracker, 1 sequence, 3 runs", Path("results/two")) as progress:
        progress.expect(execution)
        progress.begin()
        progress.update(1)
        for row in ROWS[:2]:
            progress.add(row)
        progress.update(15)
        assert screen.shown.wait(300)
        progress.add(ROWS[2])
        progress.update(30)
    text = screen.getvalue()
    assert text.count("ValueError: empty") == 1  # an equal failure is only counted
    assert text.endswith("\n")
    if terminal:
        assert text.startswith("two: 1 tracker, 1 sequence, 3 runs\n")
        assert "[##########..........] 2/3 runs, 1 failed, about " in text
        assert "[####################] 3/3 runs, 2 failed, " in text
        return
    assert "\r" not in text
    first, *others, last = masked(text).splitlines()
    assert first == "HH:MM:SS start  two: 1 tracker, 1 sequence, 3 runs"
    # On a busy machine, a line of progress can come before the failure.
    assert "HH:MM:SS FAILED  a on cup, 0004.png: ValueError: empty" in others
    assert "HH:MM:SS run  2/3  50%  1 failed  about N s left" in others
    assert last == "HH:MM:SS done  3/3 runs, 2 failed, N s, results/two"


def test_time_left_does_not_count_the_start_of_the_workers():
    time_left = _progress._TimeLeft()
    assert [time_left.after(seconds, 0.0) for seconds in (1, 60)] == ["", ""]
    assert time_left.after(61, 0.001) == ""  # trackers are initialised
    assert time_left.after(70, 0.01) == ""  # after kernels were compiled
    assert time_left.after(71, 0.10) == ""  # too early
    assert time_left.after(75, 0.26) == ", about 15 s left"
    assert time_left.after(84, 1.0) == ""


def test_command_without_missing_runs_shows_no_progress(screen):
    screen = screen(terminal=False)
    with RunProgress("none") as progress:
        progress.expect(SimpleNamespace(tasks=SimpleNamespace(n_runs=0, work=0)))
        progress.begin()
    assert screen.getvalue() == ""


@pytest.fixture
def terminal(monkeypatch):
    """Return a function that connects standard output and error to a terminal of some columns.

    It returns a function that returns the lines that the terminal then shows.
    """
    opened = []

    def connect(columns):
        reader, writer = pty.openpty()
        opened.append(reader)
        fcntl.ioctl(writer, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        stream = io.TextIOWrapper(io.FileIO(writer, "w"), encoding="utf-8", write_through=True)
        monkeypatch.setattr(sys, "stdout", stream)
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr(sys, "__stdout__", stream)
        monkeypatch.delenv("COLUMNS", raising=False)
        monkeypatch.setenv("TERM", "xterm")

        def read():
            pieces = []
            thread = threading.Thread(target=lambda: pieces.extend(iter(lambda: piece(), b"")))
            thread.start()
            stream.close()
            thread.join()
            return screen_lines(b"".join(pieces).decode(), columns)

        def piece():
            try:
                return os.read(reader, 1 << 16)
            except OSError:  # the other end is closed
                return b""

        return read

    yield connect
    for descriptor in opened:
        os.close(descriptor)


def screen_lines(text, columns):
    """Return the lines on a terminal after a text with carriage returns and line ends."""
    lines, column = [""], 0
    for character in text:
        if character == "\r":
            column = 0
        elif character == "\n":
            lines.append("")
        else:
            if column == columns:
                lines, column = [*lines, ""], 0
            assert character.isprintable(), repr(text)
            line = lines[-1].ljust(column)
            lines[-1] = line[:column] + character + line[column + 1 :]
            column += 1
    return [line.rstrip() for line in lines]


@pytest.mark.parametrize("columns", [40, 80])
def test_messages_are_written_above_the_bar(terminal, columns):
    read = terminal(columns)
    execution = SimpleNamespace(tasks=SimpleNamespace(n_runs=2, work=30))
    with safe_streams(), command_messages(), RunProgress("title") as progress:
        progress.expect(execution)
        progress.begin()
        progress.update(15)
        logging.getLogger("trackmark").warning("Compiling.")
        click.echo("A row.")
        print_error("no")
        print("In", "pieces.")  # noqa: T201  # what another package could do
        with progress_bar("Scoring", 3, "run") as count:  # one bar at a time
            count(3)
        progress.add({"status": "finished"})
        progress.update(30)
    *lines, bar, end = read()
    assert lines == ["title", "Compiling.", "A row.", "trackmark: no", "In pieces."]
    assert re.fullmatch(r"(\[#{20}\] )?1/2 runs, 0 failed, 1 s", bar)
    assert end == ""


@pytest.mark.parametrize("columns", [40, 200])
def test_output_in_a_terminal_is_not_cut_within_words(terminal, columns):
    words = [f"word{i}" for i in range(60)]
    row = '{"long": "' + "x y " * 60 + '"}'
    cells = "  ".join(words)
    read = terminal(columns)
    with safe_streams():
        click.echo("    " + " ".join(words))
        click.echo(" ".join(words), err=True)
        click.echo(cells)
        click.echo(row)
    lines = read()
    assert max(map(len, lines)) <= columns
    text = " ".join(lines)
    assert text.split()[:120] == words * 2
    last = lines[-1 - -(-len(row) // columns) : -1]
    assert "".join(line.ljust(columns) for line in last).rstrip() == row
    assert lines[1].startswith("    word")
    assert cells[:columns].rstrip() in lines


def test_piped_output_does_not_depend_on_the_terminal(terminal, monkeypatch):
    text = "word " * 30
    read = terminal(60)
    pipe = io.StringIO()
    monkeypatch.setattr(sys, "stdout", pipe)
    monkeypatch.setattr(sys, "__stdout__", pipe)
    with safe_streams():
        click.echo(wrap(text))
        click.echo(text, err=True)
    assert 60 < max(map(len, pipe.getvalue().splitlines())) <= MAX_WIDTH
    assert max(map(len, read())) <= 60


def test_dumb_terminal_shows_lines_instead_of_a_bar(terminal, monkeypatch):
    read = terminal(80)
    monkeypatch.setenv("TERM", "dumb")
    with safe_streams(), RunProgress("title") as progress:
        progress.expect(SimpleNamespace(tasks=SimpleNamespace(n_runs=1, work=30)))
        progress.begin()
        progress.add({"status": "finished"})
    assert [line[9:] for line in read()] == [
        "start    title",
        "done     1/1 runs, 0 failed, 1 s",
        "",
    ]


def interrupted_call(callback):
    """Call a callback in which Python ignores exceptions, and work on."""
    callback()
    end = time.monotonic() + 300
    while time.monotonic() < end:
        time.sleep(0.01)


def test_interrupt_in_a_foreign_callback_ends_the_command(monkeypatch, capsys):
    @ctypes.CFUNCTYPE(None)
    def callback():
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):
            pass

    monkeypatch.setattr(sys, "unraisablehook", sys.__unraisablehook__)
    with pytest.raises(KeyboardInterrupt), safe_streams(), interruptible():
        interrupted_call(callback)
    assert capsys.readouterr().err == ""


def test_safe_streams_let_other_packages_print_no_colours(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    with safe_streams():
        assert os.environ["NO_COLOR"] == "1"
    assert "NO_COLOR" not in os.environ


def test_question_without_standard_input_is_one_message(trackmark, monkeypatch):
    trackmark("run", "--trackers", "static", "--sequences", "data/Small", "--name", "mine")
    remove = ("results", "remove", "results/mine")
    for answer, status in (("n\n", 130), ("", 130), ("y\n", 0)):
        monkeypatch.setattr(sys, "stdin", io.StringIO(answer))
        assert "[y/N]: " in trackmark(*remove, status=status).stdout
    trackmark("run", "--trackers", "static", "--sequences", "data/Small", "--name", "mine")
    monkeypatch.setattr(sys, "stdin", None)
    assert "Add --yes" in trackmark(*remove, status=2).stderr


def test_progress_of_a_video_counts_drawn_frames(trackmark, monkeypatch):
    counts = []
    bar = nullcontext(counts.append)
    monkeypatch.setattr("trackmark.bench.commands.show.progress_bar", lambda *_: bar)
    trackmark("show", "data/Small", "--output", "small.mp4")
    assert counts == [1, 2, 3, 4, 5]
