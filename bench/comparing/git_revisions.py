"""Trackers as they were in an earlier revision of the git repository that holds them."""

import io
import subprocess
import tarfile
from dataclasses import replace
from pathlib import Path

import trackers
from bench.comparing.baseline import BaselineError
from bench.evaluation.turns import Setup
from trackers.base.catalogue import in_file, is_outside

_PACKAGE = Path(str(trackers.__file__)).resolve().parent


def older_setup(revision: str, now: Setup, folder: Path) -> Setup:
    """Take a tracker out as of a revision, with what lies beside it there.

    A tracker of a file comes with the file's folder, which also takes its place where modules are
    looked for, and else meets today's packages; one of ours comes with the whole package
    `trackers`.

    `revision`: whatever git knows. `now`: the tracker as it is. `folder`: where it is laid down.

    Raises `BaselineError` where it can't be had.
    """
    name = now.name
    place = in_file(name)
    if place is None and is_outside(name):
        raise BaselineError(
            f"{name} comes from an installed package, and can't be had as of {revision}. Name its "
            "file: --against takes trackers of files and of trackmark itself."
        )
    if place is None:
        file, class_name = _PACKAGE / f"{name.replace('-', '_')}.py", ""
    else:
        file, class_name = place[0].resolve(), place[1]
    commit = _git(
        file.parent, "rev-parse", "--verify", "--end-of-options", f"{revision}^{{commit}}"
    )
    # In a folder, git packs what lies in this folder, with paths from there.
    packed = _git(file.parent, "archive", "--format=tar", commit.decode().strip())
    target = folder / "trackers" if place is None else folder
    try:
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(target, filter="data")
    except (tarfile.TarError, OSError) as error:
        raise BaselineError(f"{revision} of {file.parent} can't be laid down: {error}") from error
    then = target / file.name
    if not then.is_file():
        raise BaselineError(f"{revision} has no {file.name} in {file.parent}.")
    if place is None:
        return replace(now, home=str(folder), revision=revision)
    name = f"{then}:{class_name}" if class_name else str(then)
    # Beside our own packages it meets these as they are.
    swapped = () if file.parent == _PACKAGE.parent else (str(file.parent), str(folder))
    return replace(now, name=name, revision=revision, swapped=swapped)


def _git(folder: Path, *arguments: str) -> bytes:
    command = ["git", "-C", str(folder), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, check=False)  # noqa: S603  # as typed
    except OSError as error:
        raise BaselineError(f"--against needs git, which can't be run: {error}") from error
    if done.returncode:
        said = "".join(done.stderr.decode(errors="replace").strip().splitlines()[-1:])
        if "single revision" in said:
            said = f"there is no revision {arguments[-1].removesuffix('^{commit}')!r}"
        raise BaselineError(f"--against: of {folder}, git says: {said or 'nothing'}.")
    return done.stdout
