#!/usr/bin/env python3
"""Run the project from a clean clone; the first call also sets it up.

    python3 run.py demo      any verb of the command `retract`, with its arguments
    python3 run.py test      lint, types and tests; further arguments go to pytest (-n 0: all in one process)

Set-up makes .venv beside this file, installs the versions pinned in requirements.lock, and on Debian as root
also the system packages that they need; the tests need some more. Calls after the first find all that in place
and start at once.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

OLDEST_PYTHON = (3, 11)
THIS_PYTHON = sys.version_info[:2]
ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
WINDOWS = os.name == "nt"
SCRIPTS = VENV / ("Scripts" if WINDOWS else "bin")
EXE = ".exe" if WINDOWS else ""
PYTHON = SCRIPTS / f"python{EXE}"
LOCK = ROOT / "requirements.lock"
STAMP = VENV / "installed-from"

# What the wheels load from a Linux system, and the Debian package of each. All but the last are for Qt;
# without the last, numba aborts once two threads are in compiled loops.
SYSTEM_LIBRARIES = {
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libglib-2.0.so.0": "libglib2.0-0",
    "libdbus-1.so.3": "libdbus-1-3",
    "libfontconfig.so.1": "libfontconfig1",
    "libgomp.so.1": "libgomp1",
}
# What the tests need beside those, to show the window on an X display of their own.
TEST_LIBRARIES = {
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxcb-shape.so.0": "libxcb-shape0",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
}
TEST_PROGRAMS = {"Xvfb": "xvfb"}
CHECKS = (
    ("-m", "ruff", "check"),
    ("-m", "ruff", "format", "--check"),
    ("-m", "mypy"),
)
# one process for what lives in real time, one for what computes: tests/conftest.py
TESTS = ("-m", "pytest", "-n", "2")


def main(arguments: list[str]) -> int:
    """Set up where needed, then run the tests or `retract`; return the exit status."""
    if not arguments or arguments[0] in ("-h", "--help"):
        say(__doc__ or "")
        return 0 if arguments else 2
    set_up()
    verb, *rest = arguments
    return test(rest) if verb == "test" else retract(arguments)


def test(pytest_arguments: list[str]) -> int:
    """Run every check, also after one has failed; return 0 only if all passed."""
    install_system_packages(missing_test_packages())
    return max(abs(status_of(check)) for check in (*CHECKS, (*TESTS, *pytest_arguments)))


def status_of(check: tuple[str, ...]) -> int:
    """Run a check to its end and return its status; Ctrl-C reaches it too, and it ends its own processes first."""
    say("$ python " + " ".join(check))
    with subprocess.Popen([PYTHON, *check], cwd=ROOT) as process:
        try:
            return process.wait()
        except KeyboardInterrupt:
            process.wait()
            raise


def retract(arguments: list[str]) -> int:
    """Become the command `retract`, so that signals reach it directly; Windows needs a child for that."""
    command = [str(SCRIPTS / f"retract{EXE}"), *arguments]
    if not WINDOWS:
        os.execv(command[0], command)
    return subprocess.run(command, check=False).returncode


def set_up() -> None:
    """Bring .venv to what requirements.lock and pyproject.toml say; do nothing where it is there already."""
    if THIS_PYTHON < OLDEST_PYTHON:
        stop(f"this is Python {sys.version.split()[0]}, but 3.11 or newer is needed: python3.11 run.py ...")
    wanted = fingerprint()
    if PYTHON.exists() and STAMP.exists() and STAMP.read_text() == wanted:
        return
    install_system_packages(missing_system_packages())
    if not venv_is_usable():
        say(f"Making {VENV}")
        run(sys.executable, "-m", "venv", "--clear", str(VENV))
    say("Installing the pinned packages into .venv; the first time this takes a minute or two")
    pip("--require-hashes", "--only-binary=:all:", "--requirement", str(LOCK))
    pip("--no-index", "--no-deps", "--no-build-isolation", "--editable", str(ROOT))
    STAMP.write_text(wanted)


def fingerprint() -> str:
    """Return what the contents of .venv depend on, as a digest."""
    digest = hashlib.sha256(f"{ROOT} {THIS_PYTHON}".encode())
    for source in (LOCK, ROOT / "pyproject.toml"):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def missing_system_packages() -> list[str]:
    """Return the Debian packages that this Linux still needs, found by trying."""
    missing = [package for soname, package in SYSTEM_LIBRARIES.items() if not loads(soname)]
    if importlib.util.find_spec("ensurepip") is None:
        missing.append("python{}.{}-venv".format(*THIS_PYTHON))
    return missing


def missing_test_packages() -> list[str]:
    """Return the Debian packages that the tests still need on this Linux, found by trying."""
    missing = [package for soname, package in TEST_LIBRARIES.items() if not loads(soname)]
    return missing + [package for program, package in TEST_PROGRAMS.items() if shutil.which(program) is None]


def loads(soname: str) -> bool:
    """Tell whether the dynamic linker finds a shared library."""
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True


def install_system_packages(missing: list[str]) -> None:
    """Install what a Debian lacks if root, else stop with the command that does it; nothing off Linux."""
    if sys.platform != "linux" or not missing:
        return
    install = ["apt-get", "install", "-y", "--no-install-recommends", *missing]
    if shutil.which("apt-get") is None:
        stop("system libraries are missing; install what Debian calls " + " ".join(missing))
    if os.geteuid() != 0:
        stop("system packages are missing; run: sudo apt-get update && sudo " + " ".join(install))
    say("Installing system packages: " + " ".join(missing))
    os.environ["DEBIAN_FRONTEND"] = "noninteractive"
    run("apt-get", "update", "-qq")
    run(*install, "-qq")


def venv_is_usable() -> bool:
    """Tell whether .venv holds this version of Python, with pip."""
    if not PYTHON.exists():
        return False
    probe = f"import pip, sys; sys.exit(sys.version_info[:2] != {THIS_PYTHON})"
    return subprocess.run([PYTHON, "-c", probe], stderr=subprocess.DEVNULL, check=False).returncode == 0


def pip(*arguments: str) -> None:
    """Install into .venv."""
    run(str(PYTHON), "-m", "pip", "install", "--disable-pip-version-check", *arguments)


def run(*command: str) -> None:
    """Run one step of the set-up, its output on standard error, and stop if it fails."""
    status = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=sys.stderr, check=False).returncode
    if status:
        stop(f"set-up failed (status {status}) at: {' '.join(command)}")


def say(message: str) -> None:
    """Print to standard error; standard output belongs to what is run."""
    sys.stderr.write(message + "\n")
    sys.stderr.flush()


def stop(message: str) -> None:
    """End with one line and exit status 2."""
    say(f"run.py: {message}")
    raise SystemExit(2)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
