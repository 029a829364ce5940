#!/usr/bin/env python3
"""Run the project from a clean clone; the first call also sets it up.

    python3 run.py demo      any verb of the command `retract`, with its arguments
    python3 run.py test      lint, types and tests; further arguments go to pytest (-n 0: all in one process)

Set-up makes .venv beside this file, installs the versions pinned in requirements.lock, for the tests those in
requirements-dev.lock, and on Debian as root also the system packages that they need. It tells how far it is; what pip
said stands in .venv/set-up.log. Calls after the first find all that in place and start at once, and where a set-up was
interrupted the next call goes on with it.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import os
import queue
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import TextIO

OLDEST_PYTHON, THIS_PYTHON = (3, 11), sys.version_info[:2]
ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
WINDOWS = os.name == "nt"
SCRIPTS = VENV / ("Scripts" if WINDOWS else "bin")
EXE = ".exe" if WINDOWS else ""
PYTHON = SCRIPTS / f"python{EXE}"
TO_RUN = ROOT / "requirements.lock"
TO_TEST = ROOT / "requirements-dev.lock"  # holds the former, in the same versions
STAMP = VENV / "installed-from"
LOG = VENV / "set-up.log"

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
# What the tests need beside those, libraries and a program, to show the window on an X display of their own.
TEST_NEEDS = {
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxcb-shape.so.0": "libxcb-shape0",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
    "Xvfb": "xvfb",
}
CHECKS = (("-m", "ruff", "check"), ("-m", "ruff", "format", "--check"), ("-m", "mypy"))
# what pip says of a package: its name, and how much of it was fetched
LOOKED_UP = r"(?:Collecting|Requirement already satisfied:|Processing (?:\S*[/\\])?) ?(\w[\w.]*)"
FETCHED = r"\s*(?:Downloading|Using cached) \S+\.whl \(([\d.]+) ([kM]?B)\)"
# two processes for what lives in real time and waits half of it, one for what computes; none is replaced
TESTS = ("-m", "pytest", "-n", "3", "--max-worker-restart", "0")


def main(arguments: list[str]) -> int:
    """Set up where needed, then run the tests or `retract`; return the exit status."""
    if not arguments or arguments[0] in ("-h", "--help"):
        say(__doc__ or "")
        return 0 if arguments else 2
    for name in ("SIGTERM", "SIGHUP"):
        if (number := getattr(signal, name, None)) is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, lambda number, _: sys.exit(128 + number))
    # Without compiled modules each process compiles some two thousand anew; they need not lie beside the sources.
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", ""):
        os.environ.setdefault("PYTHONPYCACHEPREFIX", str(VENV / "compiled"))
    verb, *rest = arguments
    set_up(TO_TEST if verb == "test" else TO_RUN)
    return test(rest) if verb == "test" else retract(arguments)


def test(pytest_arguments: list[str]) -> int:
    """Run every check, also after one has failed; return 0 only if all passed."""
    install_system_packages(packages_missing(TEST_NEEDS))
    return max(abs(status_of(check)) for check in (*CHECKS, (*TESTS, *pytest_arguments)))


def status_of(check: tuple[str, ...]) -> int:
    """Run a check to its end and return its status; Ctrl-C reaches it too, and it ends its own processes first."""
    say("$ python " + " ".join(check))
    with subprocess.Popen([PYTHON, *check], cwd=ROOT) as process:
        try:
            return process.wait()
        except (KeyboardInterrupt, SystemExit) as ended:
            if isinstance(ended, SystemExit):
                process.terminate()
            process.wait()
            raise


def retract(arguments: list[str]) -> int:
    """Become the command `retract`, so that signals reach it directly; Windows needs a child for that."""
    command = [str(SCRIPTS / f"retract{EXE}"), *arguments]
    return subprocess.call(command) if WINDOWS else os.execv(command[0], command)


def set_up(lock: Path) -> None:
    """Bring .venv to what a lock and pyproject.toml say; do nothing where it is there already."""
    if THIS_PYTHON < OLDEST_PYTHON:
        stop(f"this is Python {sys.version.split()[0]}, but 3.11 or newer is needed: python3.11 run.py ...")
    if PYTHON.exists() and STAMP.exists() and fingerprint(lock) in STAMP.read_text().split():
        return
    missing = packages_missing(SYSTEM_LIBRARIES)
    if importlib.util.find_spec("ensurepip") is None:
        missing.append("python{}.{}-venv".format(*THIS_PYTHON))
    install_system_packages(missing)
    if not venv_is_usable():
        say(f"Making {VENV}")
        run(sys.executable, "-m", "venv", "--clear", str(VENV))
    STAMP.unlink(missing_ok=True)
    forget_half_installed()
    say(f"Installing the packages of {lock.name} into .venv; the first time this takes a minute or two")
    with LOG.open("w", buffering=1, encoding="utf-8") as log:
        pip(log, "--require-hashes", "--only-binary=:all:", "--requirement", str(lock))
        pip(log, "--no-index", "--no-deps", "--no-build-isolation", "--editable", str(ROOT))
    STAMP.write_text("\n".join(fingerprint(one) for one in {TO_RUN, lock}))


def fingerprint(lock: Path) -> str:
    """Return what the contents of .venv depend on, as a digest."""
    contents = lock.read_bytes() + (ROOT / "pyproject.toml").read_bytes()
    return hashlib.sha256(f"{ROOT} {THIS_PYTHON}".encode() + contents).hexdigest()


def forget_half_installed() -> None:
    """Remove the records of packages on which pip was interrupted, else it would take them for installed.

    The name of the installer is the first thing that pip writes once all files of a package are there.
    """
    for place in installed():
        if not (place / "INSTALLER").exists():
            shutil.rmtree(place)


def installed() -> Iterator[Path]:
    """Yield the record, a folder, of every package in .venv."""
    return VENV.glob("Lib/site-packages/*.dist-info" if WINDOWS else "lib/python*/site-packages/*.dist-info")


def packages_missing(needs: dict[str, str]) -> list[str]:
    """Return the Debian packages of what this Linux does not have, found by trying."""
    return [package for name, package in needs.items() if not is_there(name)]


def is_there(name: str) -> bool:
    """Tell whether the dynamic linker finds a shared library, or the search path a program."""
    if ".so." not in name:
        return shutil.which(name) is not None
    try:
        ctypes.CDLL(name)
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
    probe = f"import pip, sys; sys.exit(sys.version_info[:2] != {THIS_PYTHON})"
    return PYTHON.exists() and subprocess.call([PYTHON, "-c", probe], stderr=subprocess.DEVNULL) == 0


def pip(log: TextIO, *arguments: str) -> None:
    """Install into .venv and tell how far it is, stop if it fails; what pip says goes into the log."""
    # modules are compiled when they are first imported: most never are, and half of the time would go into that
    command = [str(PYTHON), "-m", "pip", "install", "--disable-pip-version-check", "--no-color"]
    command += ["--progress-bar", "off", "--no-compile", *arguments]
    quiet, pipe, both = subprocess.DEVNULL, subprocess.PIPE, subprocess.STDOUT
    process = subprocess.Popen(command, stdin=quiet, stdout=pipe, stderr=both, text=True, errors="replace")
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    threading.Thread(target=pass_on, args=(process.stdout, lines), daemon=True).start()
    shown, errors = Installation(), []
    try:
        while (line := next_line(lines)) is not None:
            log.write(line)
            shown.hear(line)
            errors += [line.strip()] if line.startswith("ERROR") else []
    except BaseException:
        process.terminate()
        say(f"\nset-up is not finished; the same command goes on with it. What pip said is in {LOG}")
        raise
    finally:
        status = process.wait()
    if status:
        reason = errors[-1] if errors else f"status {status}"
        stop(f"set-up failed, pip says: {reason}; all it said is in {LOG}; the same command tries it again")
    shown.end()


def pass_on(said: TextIO, lines: queue.SimpleQueue[str | None]) -> None:
    """Put what a process says into a queue, line by line, and None at its end."""
    for line in chain(said, [None]):
        lines.put(line)


def next_line(lines: queue.SimpleQueue[str | None]) -> str | None:
    """Return the next line, an empty one when none has come for a while, None at the end."""
    try:
        return lines.get(timeout=0.5)
    except queue.Empty:
        return ""


class Installation:
    """Tells how far pip is: one line that changes on a terminal, else a line every few seconds."""

    def __init__(self) -> None:
        self._began_s = self._told_s = time.monotonic()
        self._there = len(list(installed()))
        self._found = self._wanted = 0
        self._mb = 0.0
        self._newest = "the list"

    def hear(self, line: str) -> None:
        """Take a line of pip's, empty where time has passed, and tell how it stands now and then."""
        if match := re.match(LOOKED_UP, line):
            self._found += 1
            self._newest = match[1]
        elif match := re.match(FETCHED, line):
            self._mb += float(match[1]) * {"B": 1e-6, "kB": 1e-3, "MB": 1.0}[match[2]]
        elif line.startswith("Installing collected packages:"):
            self._wanted = line.count(",") + 1
        if self._wanted:
            done = min(len(list(installed())) - self._there, self._wanted)
            now = f"{max(done, 0)} of {self._wanted} packages installed, {self._mb:.0f} MB fetched"
        else:
            now = f"{self._found} packages looked up, {self._mb:.0f} MB fetched; now {self._newest}"
        if time.monotonic() - self._told_s >= (0.2 if sys.stderr.isatty() else 5.0):
            self._tell(now)

    def end(self) -> None:
        """Tell once more, and leave the line."""
        if self._wanted:
            self._tell(f"{self._wanted} of {self._wanted} packages installed, {self._mb:.0f} MB fetched")
        if sys.stderr.isatty():
            say("")

    def _tell(self, now: str) -> None:
        self._told_s = time.monotonic()
        words = f"  {self._told_s - self._began_s:4.0f} s: {now}"
        if sys.stderr.isatty():
            width = shutil.get_terminal_size().columns - 1
            say(f"\r{words[:width]:{width}}", end="")
        else:
            say(words)


def run(*command: str) -> None:
    """Run one step of the set-up, its output on standard error, and stop if it fails."""
    if status := subprocess.call(command, stdin=subprocess.DEVNULL, stdout=sys.stderr):
        stop(f"set-up failed (status {status}) at: {' '.join(command)}")


def say(message: str, end: str = "\n") -> None:
    """Print to standard error; standard output belongs to what is run."""
    sys.stderr.write(message + end)
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
