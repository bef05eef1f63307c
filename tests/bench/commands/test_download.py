"""`download` from a server on the loopback, with small archives."""

import hashlib
import io
import json
import re
import threading
import tomllib
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace
from zipfile import ZipFile

import cv2
import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import download


def zipped(files):
    """Return a ZIP file with the given contents by name."""
    buffer = io.BytesIO()
    with ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def images(pattern):
    rng = np.random.default_rng(1)
    pictures = [rng.integers(0, 255, (240, 320, 3)).astype(np.uint8) for _ in range(3)]
    return {pattern % (i + 1): cv2.imencode(".jpg", pictures[i])[1].tobytes() for i in range(3)}


def otb_archive(name):
    truth = {f"{name}/groundtruth_rect.txt": "1\t1\t9\t9\n" * 3, "__MACOSX/._x": "x"}
    return zipped(images(f"{name}/img/%04d.jpg") | truth)


@pytest.fixture
def server(monkeypatch, tmp_path):
    """Start a server, and let the table of sources name only its addresses.

    `files`: contents by path. `cuts`: number of bytes after which an answer ends. `lengths`:
    declared length. `ranges`: requested range of each request, None without one.
    """
    state = SimpleNamespace(files={}, cuts={}, lengths={}, ranges=[], knows_ranges=True)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            state.ranges.append(self.headers["Range"])
            if self.path not in state.files:
                self.send_error(404)
                return
            content = state.files[self.path]
            start = 0
            if self.headers["Range"] and state.knows_ranges:
                start = int(re.fullmatch(r"bytes=(\d+)-", self.headers["Range"])[1])
            self.send_response(206 if start else 200)
            rest = content[start:]
            self.send_header("Content-Length", state.lengths.get(self.path, len(rest)))
            self.end_headers()
            self.wfile.write(rest[: state.cuts.get(self.path)])

        def log_message(self, *_):
            pass

    web = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    state.address = f"http://127.0.0.1:{web.server_port}"
    table = tmp_path / "sources.toml"
    table.write_text(
        f"""[otb]
page = "http://page"
size = "1 kB"
archives = "{state.address}/{{name}}.zip"
names = "Cup Dog"

[vot]
page = "http://page"
size = "1 kB"
description = "{state.address}/main/description.json"
"""
    )
    monkeypatch.setattr(download, "SOURCES", table)
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    thread = threading.Thread(target=web.serve_forever)
    thread.start()
    yield state
    web.shutdown()
    thread.join()
    web.server_close()


@pytest.fixture
def otb_server(server):
    server.files |= {f"/{name}.zip": otb_archive(name) for name in ("Cup", "Dog")}
    return server


def left_overs(folder):
    """Return names in a folder without those of complete sequences."""
    return {path.name for path in folder.iterdir()} - {"Cup", "Dog", "downloads.txt"}


def test_download_writes_readable_sequences_once(trackmark, otb_server, workspace):
    done = trackmark("download", "otb", "--to", "OTB")
    assert done.stdout == "Cup  downloaded\nDog  downloaded\n"
    assert not left_overs(workspace / "OTB")
    assert len(datasets.load(workspace / "OTB" / "Dog")) == 3
    done = trackmark("download", "otb", "--to", "OTB")
    assert done.stdout == "Cup  exists\nDog  exists\n"
    assert len(otb_server.ranges) == 2


@pytest.mark.parametrize("knows_ranges", [True, False])
def test_interrupted_download_is_resumed(trackmark, otb_server, workspace, knows_ranges):
    otb_server.knows_ranges = knows_ranges
    otb_server.cuts["/Cup.zip"] = 150_000
    error = trackmark("download", "otb", "Cup", "Dog", "--to", "OTB", status=2).stderr
    assert left_overs(workspace / "OTB") == {"Cup.zip.part"}
    size = (workspace / "OTB" / "Cup.zip.part").stat().st_size
    assert 80_000 < size <= 150_000
    assert f"Cup.zip: the connection failed after {size} bytes" in error
    assert not (workspace / "OTB" / "Dog").exists()  # it needs the same server
    otb_server.cuts.clear()
    trackmark("download", "otb", "Cup", "--to", "OTB")
    assert otb_server.ranges == [None, f"bytes={size}-"]
    assert not left_overs(workspace / "OTB")
    assert len(datasets.load(workspace / "OTB" / "Cup")) == 3


def test_archive_of_wrong_length_is_removed(trackmark, otb_server, workspace):
    otb_server.lengths["/Cup.zip"] = 1000
    error = trackmark("download", "otb", "Cup", "--to", "OTB", status=2).stderr
    assert "Cup.zip: the file is damaged or no ZIP file" in error
    assert not left_overs(workspace / "OTB")


def test_missing_file_stops_only_its_sequence(trackmark, otb_server, workspace):
    del otb_server.files["/Cup.zip"]
    done = trackmark("download", "otb", "--to", "OTB", status=2)
    assert "Cup.zip: the server answers 404 Not Found. If the address is out of" in done.stderr
    assert "http://page" in done.stderr
    assert done.stdout == "Dog  downloaded\n"


def test_full_disk_is_named_and_resumed(trackmark, otb_server, workspace):
    folder = workspace / "OTB"
    folder.mkdir()
    part = folder / "Cup.zip.part"
    part.symlink_to("/dev/full")  # every write fails as on a full disk
    error = trackmark("download", "otb", "Cup", "--to", "OTB", status=2).stderr
    assert "Cup.zip.part: No space left on device. Free some space, and start again." in error
    assert left_overs(folder) == {part.name}
    part.unlink()
    trackmark("download", "otb", "Cup", "--to", "OTB")
    assert not left_overs(folder)


def test_existing_folder_of_the_user_is_not_changed(trackmark, otb_server, workspace):
    own_file = workspace / "OTB" / "Cup" / "notes.txt"
    own_file.parent.mkdir(parents=True)
    own_file.write_text("mine")
    assert trackmark("download", "otb", "Cup", "--to", "OTB").stdout == "Cup  exists\n"
    assert list(own_file.parent.iterdir()) == [own_file]
    assert otb_server.ranges == []


def test_changed_archive_is_refused_the_second_time(trackmark, otb_server, workspace):
    trackmark("download", "otb", "Cup", "--to", "OTB")
    (workspace / "OTB" / "Cup").rename(workspace / "old")
    otb_server.files["/Cup.zip"] = otb_archive("Other")
    error = trackmark("download", "otb", "Cup", "--to", "OTB", status=2).stderr
    assert "Cup.zip: the file has another checksum than expected. It was removed" in error
    assert not left_overs(workspace / "OTB")
    otb_server.files["/Cup.zip"] = otb_archive("Cup")
    trackmark("download", "otb", "Cup", "--to", "OTB")


@pytest.fixture
def vot_server(server):
    """Serve a sequence as VOT's servers do: annotations and images in archives of their own."""
    server.files["/main/ants.zip"] = zipped({"groundtruth.txt": "1,1,9,9\n" * 3})
    server.files["/sequences/ants.zip"] = zipped(images("%08d.jpg"))
    about = {
        "name": "ants",
        "fps": 25,
        "annotations": {"url": "ants.zip"},
        "channels": {"color": {"url": "../sequences/ants.zip", "pattern": "%08d.jpg"}},
    }
    about["channels"]["color"]["checksum"] = hashlib.md5(
        server.files["/sequences/ants.zip"]
    ).hexdigest()
    server.files["/main/description.json"] = json.dumps({"sequences": [about]}).encode()
    return server


def test_vot_is_downloaded_by_its_description(trackmark, vot_server, workspace):
    assert trackmark("download", "vot", "--to", "VOT").stdout == "ants  downloaded\n"
    sequence = datasets.load(workspace / "VOT" / "ants")
    assert (len(sequence), sequence.fps) == (3, 25)
    assert {path.name for path in (workspace / "VOT").iterdir()} == {"ants", "downloads.txt"}
    vot_server.files["/main/description.json"] = b"<html>"
    error = trackmark("download", "vot", "--to", "VOT", status=2).stderr
    assert "description.json: this is no description of a VOT data set" in error


def test_vot_archive_with_another_checksum_is_refused(trackmark, vot_server):
    vot_server.files["/sequences/ants.zip"] = zipped(images("%07d.jpg"))
    error = trackmark("download", "vot", "--to", "VOT", status=2).stderr
    assert "sequences/ants.zip: the file has another checksum than expected" in error


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["obt"], "unknown data set 'obt'. Did you mean 'otb'?"),
        (["otb"], "--to is missing (otb: 2.7 GB)."),
        (["otb", "Basketbal", "--to", "OTB"], "unknown name 'Basketbal'. Did you mean"),
    ],
)
def test_wrong_names_are_refused(trackmark, arguments, words):
    assert words in trackmark("download", *arguments, status=2).stderr


def test_other_data_sets_print_page_size_and_steps(trackmark):
    printed = trackmark("download", "lasot").stdout
    assert [line.split()[0] for line in printed.splitlines()[:3]] == ["page", "size", "steps"]


def test_sources_state_where_addresses_were_found():
    for name, entry in tomllib.loads(download.SOURCES.read_text()).items():
        assert entry["page"].startswith("http"), name
        assert entry["size"], name
        if "steps" not in entry:
            assert re.fullmatch(r"[\w.-]+/[\w.-]+ [0-9a-f]{40} \S+", entry["evidence"]), name
            assert "names" in entry or entry["description"].endswith("/description.json"), name
