"""What software a file was made with."""

import platform
from importlib.metadata import PackageNotFoundError, version

_PACKAGES = ("retraction", "numpy", "scipy", "opencv-python-headless", "mcap")


def package_versions() -> dict[str, str]:
    """Return the versions of Python, the system and the packages that a recording depends on."""
    versions = {"python": platform.python_version(), "system": platform.platform()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed as a package"
    return versions
