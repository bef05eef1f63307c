"""Names of sequences, and where each comes from."""

from collections.abc import Mapping
from difflib import get_close_matches
from fnmatch import fnmatchcase
from functools import cache
from glob import glob
from pathlib import Path
from typing import Any, Protocol, cast

from trackmark.datasets.decoding import check_name, quote
from trackmark.datasets.interface import Sequence, SequenceError, Summary
from trackmark.datasets.metadata import SequenceMetadata, sequence_metadata
from trackmark.datasets.spec_string import close_match, natural_order, parse_text


class Suite(Protocol):
    """What offers built-in sequences: the module `samples`, or a suite of synthetic ones."""

    def names(self) -> list[str]:
        """Full names, `suite/sequence`."""
        ...

    def options(self, name: str) -> list[dict[str, Any]]:
        """What can be set of one of `names()`: dicts with `name`, `default` and `meaning`."""
        ...

    def summary(self, name: str) -> Summary:
        """Length and size of images of one of `names()` as it is by default."""
        ...

    def describe(self, name: str) -> SequenceMetadata:
        """What a description tells of one of `names()` as it is by default."""
        ...

    def load(self, name: str, options: Mapping[str, str]) -> Sequence:
        """Sequence of one of `names()`, in the variant that the options say."""
        ...


def names() -> list[str]:
    """List the built-in sequences, sorted."""
    return sorted(_suites())


def summary(name: str) -> Summary:
    """Length and size of images of one of `names()`, without opening it.

    Raises
    ------
    SequenceError
        For a name that is none of them.
    """
    if name not in _suites():
        raise _unknown(name, _path(name))
    return _suites()[name].summary(name)


def describe(name_or_path: str | Path, truth: str | Path | None = None) -> SequenceMetadata:
    """What a description tells of a sequence; arguments and errors as of `load`.

    It is opened, unless it is rendered, has all knobs at their defaults, and is as it was sealed.
    """
    text = str(name_or_path)
    if isinstance(name_or_path, str) and truth is None and text in _suites():
        return _suites()[text].describe(text)
    return sequence_metadata(load(name_or_path, truth))


def identity(text: str) -> tuple[str, str]:
    """Name and fingerprint of the sequence that `load` gives for a text; errors are as of it.

    It is opened, which takes a second where solids are rendered, unless it is a synthetic one.
    """
    from trackmark.datasets.synthetic.suite import Suite as Rendered

    suite = _suites().get(text.partition(":")[0])
    if isinstance(suite, Rendered) and not _without_filters(text)[1]:
        return suite.identity(text.partition(":")[0], _options_in(text))
    sequence = load(text)
    return sequence.name, sequence.fingerprint


def options(name: str) -> list[dict[str, Any]]:
    """What can be set of a sequence by `name:key=value`, or chosen of recorded data.

    Returns
    -------
    list of dict
        `name`, `default` and `meaning` (unit in brackets); empty where there is no choice.
    """
    if not is_built_in(name):
        from trackmark.datasets import readers

        return readers.options(_path_and_choice(name)[0])
    bare = name.partition(":")[0]
    return _suites()[bare].options(bare)


def is_built_in(text: str) -> bool:
    """Whether `load` takes a text for the name of a built-in sequence, not for a path."""
    return text.partition(":")[0] in _suites()


def path_format(text: str) -> str:
    """What a path is taken for, in words; empty for a built-in name and for what nobody knows.

    Raises `SequenceError` where the path can't be looked at.
    """
    text, _ = _without_filters(text)
    if is_built_in(text):
        return ""
    from trackmark.datasets import readers

    return readers.path_format(_path_and_choice(text)[0])


def matching(text: str) -> list[str]:
    """Sequences that a text stands for: itself, those of a pattern, or those in a folder.

    Parameters
    ----------
    text : str
        As for `load`; or a pattern with `*` and `?`, of built-in names (also with options) or of
        paths; or a suite or a folder, for all sequences in it.

    Returns
    -------
    list of str
        One at least, in the order of their names.

    Raises
    ------
    SequenceError
        For a pattern that matches no sequence, and for a sequence in a folder that isn't whole.
    """
    bare, filters = _without_filters(text)
    if filters:
        from trackmark.datasets.filters import with_filters

        return [with_filters(name, filters) for name in matching(bare)]
    if is_built_in(text):
        return [text]
    pattern, colon, options = text.partition(":")
    if not any(sign in text for sign in "*?"):
        pattern = f"{pattern.rstrip('/')}/*"
    built_in = [f"{name}{colon}{options}" for name in names() if fnmatchcase(name, pattern)]
    return built_in or _paths_matching(text)


def _paths_matching(text: str) -> list[str]:
    """Paths that a text stands for; see `matching`."""
    from trackmark.datasets import readers

    path, chosen = _path_and_choice(text)
    is_pattern = any(sign in text for sign in "*?") and not path.exists()
    # Path.glob raises where a name is too long, this one finds nothing there.
    found = [Path(name) for name in glob(str(path))] if is_pattern else [path]  # noqa: PTH207
    if is_pattern:
        found = [place for place in found if not readers.holds_masks(place)]
    paths = [
        str(sequence)
        for place in sorted(found, key=lambda place: natural_order(str(place)))
        for sequence in readers.sequence_paths(place) or readers.sequences_in(place)
    ]
    if is_pattern and not paths:  # names in a folder that holds its sequences further inside
        paths = [str(sequence) for sequence in readers.sequences_in(path.parent, path.name)]
    if paths and not chosen:
        return paths
    if not is_pattern:
        return [text]  # `load` says what is wrong with it
    if paths:
        raise SequenceError(
            f"{quote(text)}: a pattern of paths takes no options. Name the sequences, each with "
            "its own."
        )
    near = ", ".join(get_close_matches(text, names(), n=3, cutoff=0.5)) or "none of the built-in"
    raise SequenceError(
        f"{quote(text)} matches no sequence. The nearest names: {near} (`trackmark list sequences` "
        "shows them all); as a path it matches no file or folder that is read."
    )


def load(name_or_path: str | Path, truth: str | Path | None = None) -> Sequence:
    """Open a sequence; no image is read or rendered before it is asked for.

    Parameters
    ----------
    name_or_path : str or Path
        One of `names()`, options after colons (`multipart/1:scene=2:light=even`); or the
        path of recorded data, likewise with options where there is a choice
        (`davis/bmx-trees:object=2`). Behind each there may be filters (`:filter.noise=20`, see
        `datasets.filters`). A built-in name wins over a path of the same text, unless
        that begins with `/`, `./` or `../` or is a `Path`.
    truth : str or Path, optional
        CSV file `frame,x,y,width,height` for recorded data; it wins over their own truth.

    Raises
    ------
    SequenceError
        For an unknown name, option or path, and for data that can't be read; the message
        names what was looked for, and where.

    Examples
    --------
    >>> load("samples/bow-tie")
    <Sequence samples/bow-tie: 120 frames>
    """
    text = str(name_or_path)
    bare, filters = _without_filters(text)
    if filters:
        from trackmark.datasets.filters import filtered  # OpenCV is loaded only where it is needed

        return filtered(load(type(name_or_path)(bare), truth), filters)
    if isinstance(name_or_path, str) and is_built_in(text):
        name = text.partition(":")[0]
        if truth is not None:
            raise SequenceError(f"{name}: a built-in sequence has its own truth; omit {truth}.")
        return _suites()[name].load(name, _options_in(text))
    from trackmark.datasets import readers  # decoders are loaded only for recorded data

    path, chosen = _path_and_choice(text)
    if not path.exists() and not readers.knows(path):
        raise _unknown(text, Path(text).expanduser())
    truth_file = None if truth is None else _path(str(truth))
    if truth_file is not None and not truth_file.is_file():
        raise SequenceError(f"{truth_file}: there is no such truth file.")
    return readers.read(path, truth_file, chosen)


def _options_in(text: str) -> dict[str, str]:
    """Options of a built-in sequence that a text says."""
    try:
        return parse_text(text)[1]
    except ValueError as error:
        raise SequenceError(f"sequence {error}") from None


def _without_filters(text: str) -> tuple[str, dict[str, float]]:
    """A text without the filters in it, and these; a path that is there has none."""
    if ":filter." not in text or _path(text).exists():
        return text, {}
    from trackmark.datasets.filters import split_filters

    return split_filters(text)


def _path_and_choice(text: str) -> tuple[Path, dict[str, str]]:
    """Path of recorded data, and what the text chooses of them; a path may itself hold colons."""
    path = _path(text)
    if path.exists() or ":" not in path.name:
        return path, {}
    try:
        name, chosen = parse_text(path.name)
    except ValueError:  # no options, so a part of the name
        return path, {}
    return path.parent / name, chosen


def _path(text: str) -> Path:
    """A path that can be asked whether something is there, and whose name results can hold."""
    try:
        path = Path(text).expanduser()
        check_name(path.absolute())
        path.resolve()
        path.exists()
    except RuntimeError as error:  # no such user's home, or links that run in a circle
        raise SequenceError(f"{quote(text)}: {error}") from None
    except OSError as error:
        raise SequenceError(f"{quote(text)}: this can't be read ({error.strerror}).") from None
    return path


def _unknown(text: str, path: Path) -> SequenceError:
    beside = path.parent.iterdir() if path.parent.is_dir() else ()
    candidates = [*names(), *(str(sibling) for sibling in beside)]
    hint = close_match(text.partition(":")[0], candidates)
    return SequenceError(
        f"unknown sequence {quote(text)}.{hint} It is no built-in name (`trackmark list` shows "
        f"them) and there is no file or folder {quote(str(path.absolute()))}."
    )


@cache
def _suites() -> dict[str, Suite]:
    """Suite by name of sequence; finding them brings no renderer."""
    from trackmark.datasets import samples
    from trackmark.datasets.synthetic.suite import suites

    found = [cast(Suite, samples), *suites()]
    return {name: suite for suite in found for name in suite.names()}
