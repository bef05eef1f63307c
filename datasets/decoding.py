"""Common rules of all decoders: a pixel limit, and errors that name the file."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from reprlib import Repr

from trackmark.datasets.interface import SequenceError

# environment variable with the maximum number of pixels of an image
PIXEL_LIMIT_VARIABLE = "TRACKMARK_MOST_PIXELS"

DEFAULT_MAX_PIXELS = 100_000_000

# exceptions that indicate an error in code and not in a file
PROGRAMMING_ERRORS = (AssertionError, AttributeError, ImportError, NameError, TypeError)

_MAX_REASON = 300  # maximum number of characters of a decoder's message
_REPR = Repr()
_REPR.maxstring = 200


def quote(value: str) -> str:
    """Return a text in quotes for a message; a long text is shortened in the middle."""
    return _REPR.repr(value)


def check_name(path: Path) -> None:
    """Check that messages and results can contain the name of a file or folder.

    Raises `SequenceError` for a name that is not UTF-8 or contains a NUL character.
    """
    if "\0" in str(path):
        raise SequenceError(f"{quote(str(path))}: a path cannot contain a NUL character.")
    try:
        str(path).encode()
    except UnicodeEncodeError:
        printable = str(path).encode(errors="backslashreplace").decode()
        raise SequenceError(
            f"{printable}: this name is not UTF-8. Rename the file or folder."
        ) from None


@contextmanager
def decoding(problem: str, remedy: str = "Download the file again.") -> Iterator[None]:
    """Raise a `SequenceError`, `PROBLEM (REASON). REMEDY`, if a decoder fails.

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
            reason = "decoding needs more memory than is available, or than --memory-limit allows"
        raise SequenceError(f"{problem} ({reason[:_MAX_REASON]}). {remedy}") from error


def pixel_limit() -> int:
    """Return the maximum number of pixels of an image, by default `DEFAULT_MAX_PIXELS`.

    Raises `SequenceError` if `$TRACKMARK_MOST_PIXELS` is not a number.
    """
    value = os.environ.get(PIXEL_LIMIT_VARIABLE, str(DEFAULT_MAX_PIXELS))
    if not (value.isdecimal() and len(value) < 20):
        raise SequenceError(f"{PIXEL_LIMIT_VARIABLE} is {quote(value)}. Set a number of pixels.")
    return int(value)


def check_pixels(width: int, height: int) -> None:
    """Check the size in an image's header [pixels] before memory is allocated for the image.

    Raises `ValueError` for an image that is larger than `pixel_limit`.
    """
    limit = pixel_limit()
    if width * height > limit:
        raise ValueError(
            f"its header states {width}x{height} pixels; the maximum is {limit}. Set "
            f"{PIXEL_LIMIT_VARIABLE} to raise it"
        )
