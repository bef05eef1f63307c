"""What a disk and a clock can do to a whole command: full, read-only, years away."""

import os
import resource
import subprocess

import pytest

from trackmark.bench.store.results import Results

YEAR = 365 * 24 * 3600 * 10**9


@pytest.fixture
def small_disk(tmp_path):
    """A disk of one megabyte, and what gives it other options."""
    place = tmp_path / "disk"
    place.mkdir()

    def mount(options):
        return subprocess.run(
            ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)],
            capture_output=True,
            text=True,
            check=False,
        )

    try:
        failed = mount("size=1m").stderr
    except FileNotFoundError as error:
        failed = str(error)
    if failed:
        pytest.skip(f"no disk can be made here: {failed}")
    try:
        yield place, lambda options: mount(f"remount,{options}").check_returncode()
    finally:
        subprocess.run(["umount", str(place)], check=True)


def digests(folder):
    """What the runs in a folder say, by path."""
    results = Results(folder)
    runs = {file.relative_to(folder): results.read(file) for file in results.files()}
    return {path: (run.identity, run.failure, run.boxes.tobytes()) for path, run in runs.items()}


RUN = ("run", "--trackers", "knob.py:Knob", "--sequences", "data/Small", "--name", "trial")


@pytest.mark.slow
def test_a_full_disk_ends_a_command_in_one_line_and_the_same_command_goes_on(
    typed, small_disk, tmp_path
):
    disk, remount = small_disk
    command = (*RUN, "--seeds", "200", "--json", "--output", disk)
    stopped = typed(*command, status=2)
    assert stopped.stderr.count("\n") == 1
    assert "No space left on device" in stopped.stderr
    assert str(disk) in stopped.stderr
    done = digests(disk / "trial")
    assert 0 < len(done) < 200
    remount("size=8m")
    typed(*command)
    typed(*RUN, "--seeds", "200", "--json", "--output", tmp_path / "undisturbed")
    whole = digests(disk / "trial")
    assert len(whole) == 200
    assert done.items() <= whole.items()
    assert whole == digests(tmp_path / "undisturbed" / "trial")
    typed("results", "check", disk / "trial")
    assert not list(disk.rglob("*.tmp"))


@pytest.mark.slow
def test_a_disk_that_can_only_be_read_is_reported_on_and_refused_for_runs(trackmark, small_disk):
    disk, remount = small_disk
    trackmark(*RUN, "--output", disk)
    (disk / "trial" / "index.arrow").unlink()
    remount("ro")
    assert "knob.py:Knob" in trackmark("report", disk / "trial").stdout
    trackmark("results", "check", disk / "trial")
    refused = trackmark(*RUN, "--seeds", "2", "--output", disk, status=2)
    assert refused.stderr.count("\n") == 1
    assert "Read-only file system" in refused.stderr
    assert len(digests(disk / "trial")) == 1


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_a_folder_without_permission_is_named(trackmark, here):
    folder = here / "results"
    folder.mkdir(mode=0o500)
    refused = trackmark(*RUN, status=2)
    assert refused.stderr.count("\n") == 1
    assert "Permission denied" in refused.stderr


def test_files_that_may_not_grow_are_no_runs(typed, trackmark, here):
    """A limit on the size of files stands for a full disk where none can be made."""
    stopped = typed(
        *RUN,
        status=2,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000)),
    )
    assert stopped.stderr.count("\n") == 1
    assert "File too large" in stopped.stderr
    folder = here / "results" / "trial"
    assert Results(folder).files() == []
    trackmark(*RUN)
    assert len(digests(folder)) == 1
    assert not list(folder.rglob("*.tmp"))


def test_a_clock_that_jumps_costs_nothing(trackmark, here):
    trackmark(*RUN, "--seeds", "2")
    folder = here / "results" / "trial"
    before = digests(folder)
    for number, file in enumerate(sorted(folder.rglob("*"))):
        changed = file.stat().st_mtime_ns + (-60, 40)[number % 2] * YEAR
        os.utime(file, ns=(changed, changed))
    stamps = {file: file.stat().st_mtime_ns for file in Results(folder).files()}
    trackmark(*RUN, "--seeds", "3")
    assert stamps.items() <= {f: f.stat().st_mtime_ns for f in Results(folder).files()}.items()
    assert before.items() <= digests(folder).items()
    assert "3 of 3" in trackmark(*RUN, "--seeds", "3").stdout
    trackmark("results", "check", folder)


def test_annotate_force_keeps_the_truth_on_a_full_disk(trackmark, one_line, small_disk, otb):
    disk, _ = small_disk
    video = otb(disk.parent / "Long", 200) / "img"
    truth = disk / "truth.csv"
    truth.write_text("# by hand\nframe,x,y,width,height\n0,1,1,9,9\n")
    before = truth.read_bytes()
    free = os.statvfs(disk)
    (disk / "filler").write_bytes(bytes(free.f_bavail * free.f_bsize))
    assert os.statvfs(disk).f_bavail == 0
    boxes = ("--box", "0:4,5,10.123456789,12", "--box", "199:8,5,10,12")
    message = one_line(trackmark("annotate", video, *boxes, "--output", truth, "--force", status=2))
    assert message == f"trackmark: {truth}: cannot write (No space left on device)."
    assert truth.read_bytes() == before
    assert sorted(file.name for file in disk.iterdir()) == ["filler", "truth.csv"]
