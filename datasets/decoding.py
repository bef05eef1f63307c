"""What all decoding keeps to: a limit of pixels, and errors that are told in the file's name."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from reprlib import Repr

from trackmark.datasets.interface import SequenceError

# Pixels of the largest image that is decoded, and the environment variable that overrides it.
LIMIT, MOST_PIXELS = "TRACKMARK_MOST_PIXELS", 100_000_000
# Exceptions that show a defect of our code or of a library, not of the file.
PROGRAMMING_ERRORS = (AssertionError, AttributeError, ImportError, NameError, TypeError)
_LONGEST_REASON = 300
_BRIEF = Repr()
_BRIEF.maxstring = 200


def quote(text: str) -> str:
    """A text in quotes for a message: of a long one its two ends."""
    return _BRIEF.repr(text)


def check_name(path: Path) -> None:
    """Refuse a name that is no text: results and messages could not hold it.

    Raises `SequenceError` for a name that is not UTF-8 or contains a NUL character.
    """
    if "\0" in str(path):
        raise SequenceError(f"{quote(str(path))}: a path cannot contain a NUL character.")
    try:
        str(path).encode()
    except UnicodeEncodeError:
        said = str(path).encode(errors="backslashreplace").decode()
        raise SequenceError(f"{said}: this name is not UTF-8. Rename the file or folder.") from None


@contextmanager
def decoding(what: str, advice: str = "Get the file anew.") -> Iterator[None]:
    """Raise a `SequenceError`, `WHAT (REASON). ADVICE`, if a decoder fails.

    `PROGRAMMING_ERRORS` pass unchanged: they do not depend on the file.
    """
    try:
        yield
    except (SequenceError, *PROGRAMMING_ERRORS):
        raise
    # For damaged files, decoders raise exceptions of many types: SyntaxError, struct.error,
    # UnicodeDecodeError, cv2.error, …, and MemoryError if the limit is high.
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        if isinstance(error, MemoryError):
            reason = "decoding it takes more memory than there is, or than --memory-limit allows"
        raise SequenceError(f"{what} ({reason[:_LONGEST_REASON]}). {advice}") from error


def pixel_limit(most: int | None = None) -> int:
    """Pixels of the largest image that is decoded: so many, or what holds where none is given.

    Raises `SequenceError` where `$TRACKMARK_MOST_PIXELS` is no number.
    """
    if most is not None:
        return most
    own = os.environ.get(LIMIT, str(MOST_PIXELS))
    if not (own.isdecimal() and len(own) < 20):
        raise SequenceError(f"{LIMIT} is {quote(own)}; give a number of pixels.")
    return int(own)


def check_pixels(width: int, height: int, most: int | None = None) -> None:
    """Refuse an image before memory is taken for it.

    `width` and `height` are what its header says [pixels]; `most` is as for `pixel_limit`.

    Raises `ValueError` for a larger image.
    """
    most = pixel_limit(most)
    if width * height > most:
        raise ValueError(
            f"it claims {width}x{height} pixels, more than the {most} that are decoded; "
            f"{LIMIT} sets another limit"
        )
