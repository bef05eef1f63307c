"""Replacement and protection of files by `write_file`."""

import os
import stat
import subprocess
import sys
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.bench.output_files import file_names, write_file


def write(text):
    return lambda file: file.write_text(text)


def test_write_file_keeps_permissions(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o640)
    write_file(path, write("new"))
    assert path.stat().st_mode & 0o7777 == 0o640
    new = write_file(tmp_path / "b.txt", write("new"))
    umask = os.umask(0)
    os.umask(umask)
    assert new.stat().st_mode & 0o7777 == 0o666 & ~umask


@pytest.mark.parametrize("exists", [True, False], ids=["file", "dangling"])
def test_write_file_replaces_the_target_of_a_link(tmp_path, exists):
    target = tmp_path / "elsewhere" / "a.txt"
    target.parent.mkdir()
    if exists:
        target.write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to("elsewhere/a.txt")
    write_file(link, write("new"))
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert [file.name for file in target.parent.iterdir()] == ["a.txt"]


def test_write_file_keeps_the_target_after_a_failure(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to(target)

    def fail(file):
        file.write_text("ne")
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match=r"cannot write \(No space left on device\)") as raised:
        write_file(link, fail)
    assert raised.value.filename == str(link)
    assert (link.is_symlink(), target.read_text()) == (True, "old")


def test_write_file_writes_to_a_fifo(tmp_path):
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    received = []
    reader = threading.Thread(target=lambda: received.append(fifo.read_text()), daemon=True)
    reader.start()
    write_file(fifo, write("new"))
    assert fifo.is_fifo()
    reader.join(60)
    assert received == ["new"]


@pytest.fixture
def device(tmp_path):
    """Provide a null device of the test: broken code run by root would replace the real one."""
    path = tmp_path / "null"
    try:
        os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        path.write_text("")
    except OSError as error:
        pytest.skip(f"no device can be made here: {error}")
    return path


@pytest.mark.parametrize("linked", [False, True])
def test_write_file_writes_to_a_device(tmp_path, device, linked):
    path = device
    if linked:
        path = tmp_path / "link.txt"
        path.symlink_to(device)
    write_file(path, write("new"))
    assert device.is_char_device()
    assert path.is_symlink() == linked


def test_write_file_appends_to_a_redirected_standard_output(tmp_path):
    # As /dev/stdout, which broken code run by root would replace.
    (tmp_path / "stdout").symlink_to("/proc/self/fd/1")
    code = """
import sys
from pathlib import Path
from trackmark.bench.output_files import write_file
print("before", flush=True)
write_file(Path(sys.argv[1]), lambda file: file.write_text("new\\n"))
print("after")
"""
    with (tmp_path / "out.txt").open("w") as output:
        command = [sys.executable, "-c", code, tmp_path / "stdout"]
        subprocess.run(command, stdout=output, check=True)
    assert (tmp_path / "out.txt").read_text() == "before\nnew\nafter\n"
    assert (tmp_path / "stdout").is_symlink()


def test_write_file_refuses_a_loop_of_links_and_a_folder(tmp_path):
    loop = tmp_path / "loop.txt"
    loop.symlink_to("loop.txt")
    (tmp_path / "file").write_text("")
    below_file = tmp_path / "file" / "p.png"
    for path, words in (
        (loop, "Too many levels"),
        (tmp_path, "Is a directory"),
        (below_file, "Not a directory"),
    ):
        with pytest.raises(OSError, match=words) as raised:
            write_file(path, write("new"))
        assert raised.value.filename == str(path)
    assert loop.is_symlink()


def test_write_file_accepts_the_longest_name(tmp_path):
    path = tmp_path / f"{'x' * 251}.txt"
    assert write_file(path, write("new")).read_text() == "new"


@pytest.mark.parametrize("output", ["é\n", "é\n".encode()])
def test_write_file_accepts_text_and_bytes(tmp_path, output):
    assert write_file(tmp_path / "a.txt", output).read_text("utf-8") == "é\n"


@settings(max_examples=30)
@given(st.lists(st.text(min_size=1) | st.text("aA-|/", min_size=1), unique=True, max_size=6))
def test_labels_have_distinct_names_of_files(labels):
    names = file_names([*labels, *(label * 80 for label in labels[:1])])
    assert len({name.casefold() for name in names.values()}) == len(names)
    for name in names.values():
        assert "/" not in name
        assert len(f"frames-{name}.png".encode()) < 255
    assert file_names(["samples/face"]) == {"samples/face": "samples-face"}
