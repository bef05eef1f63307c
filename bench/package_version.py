"""Version of trackmark, for pages and reports."""

from importlib.metadata import PackageNotFoundError, version


def package_version() -> str:
    """Return the version of trackmark; of a folder that is only on the module path, `unknown`."""
    try:
        return version("trackmark")
    except PackageNotFoundError:
        return "unknown"
