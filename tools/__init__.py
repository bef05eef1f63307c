"""Tools for developers of trackmark, which are not part of the wheel."""
