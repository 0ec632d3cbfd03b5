"""The version of this program as installed: in headers of journals, models and reports."""

from importlib.metadata import PackageNotFoundError, version


def program_version() -> str:
    """The version, or "not installed" in a source tree that pip knows nothing of."""
    try:
        return version("auv-mils")
    except PackageNotFoundError:
        return "not installed"
