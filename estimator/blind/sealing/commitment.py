"""A commitment: hashes that are published with the cases, and that keys which are revealed later must match.

``keys.sha256`` and ``cases.sha256`` are lists as ``sha256sum`` writes and checks them. A key holds 256 random bits, its
salt, so that nobody finds it by hashing all that a key may say.
"""

import hashlib
import re
import secrets
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from estimator.blind.sealing.key_files import key_files
from estimator.errors import InputError
from estimator.input_file import MOST_TEXT_BYTES, parse_toml, read_input, read_input_text

KEYS_LIST, CASES_LIST = "keys.sha256", "cases.sha256"
COMMITMENT_FORMAT = "retraction-commitment/1"

_SALT_BYTES = 32
_LINE = re.compile(r"([0-9a-f]{64}) [ *](\S.*)")
_HEAD = re.compile(rf"# {re.escape(COMMITMENT_FORMAT)}\n# {re.escape(CASES_LIST)} ([0-9a-f]{{64}})\n")


@dataclass(frozen=True, slots=True)
class Commitment:
    """What a set is committed to.

    Attributes
    ----------
    set_hash : SHA-256 of ``keys.sha256``, which stands for the whole set
    cases_hash : SHA-256 of ``cases.sha256``
    keys : hash of each key, by its path in the folder of the keys
    """

    set_hash: str
    cases_hash: str
    keys: Mapping[str, str]


def commit(cases: Path, keys: Path) -> Commitment:
    """Write the lists of hashes of a set beside its cases and beside its keys, and return the commitment.

    A key without a salt is given one. A set that is committed to already may be added to, and not be altered.

    Raises
    ------
    InputError
        A case has no key, a key no case, or a key is not the one that was committed to.
    """
    files = key_files(keys)
    names = {folder.name for folder in cases.iterdir() if folder.is_dir() and not folder.name.startswith(".")}
    if lonely := sorted(names ^ files.keys()):
        what = "case has no key" if lonely[0] in names else "key has no case"
        raise InputError(
            f"{lonely[0]}: this {what}; cases in {cases} and keys in {keys} must bear the same names"
        )
    if (keys / KEYS_LIST).exists():
        check_keys(keys, read_commitment(keys), complete=False)
    for file in files.values():
        _with_salt(file)
    of_cases = _list_of(cases, _files_of_cases(cases, names))
    cases_hash = hashlib.sha256(of_cases.encode()).hexdigest()
    of_keys = f"# {COMMITMENT_FORMAT}\n# {CASES_LIST} {cases_hash}\n{_list_of(keys, files.values())}"
    (cases / CASES_LIST).write_text(of_cases, encoding="utf-8", newline="\n")
    for folder in (cases, keys):
        (folder / KEYS_LIST).write_text(of_keys, encoding="utf-8", newline="\n")
    return read_commitment(cases)


def read_commitment(folder: Path) -> Commitment:
    """Read the commitment in a folder of cases or of keys.

    Raises
    ------
    InputError
        There is none, or it cannot be read.
    """
    file = folder / KEYS_LIST
    text = read_input_text(file).replace("\r\n", "\n")
    head = _HEAD.match(text)
    if head is None:
        raise InputError(
            f"{file}: does not begin as {COMMITMENT_FORMAT}; fetch it again from whoever published it"
        )
    return Commitment(hashlib.sha256(text.encode()).hexdigest(), head[1], _parsed(text, file))


def check_keys(keys: Path, commitment: Commitment, *, complete: bool = True) -> None:
    """Check that keys are those of a commitment, and unless ``complete`` is false that there are no others.

    Raises
    ------
    InputError
        A key is missing, has been altered, or was never committed to.
    """
    found = {file.relative_to(keys).as_posix() for file in key_files(keys).values()}
    for name, expected in commitment.keys.items():
        if name not in found:
            raise InputError(
                f"{keys / name}: this key was committed to and is missing; fetch all keys of the set"
            )
        if _hash_of(keys / name) != expected:
            raise InputError(
                f"{keys / name}: is not the key that was committed to ({KEYS_LIST} says {expected[:12]}…); restore it"
            )
    if complete and (others := sorted(found - commitment.keys.keys())):
        raise InputError(
            f"{keys / others[0]}: was never committed to; take it away, or commit to the set anew"
        )


def check_cases(cases: Path, commitment: Commitment) -> None:
    """Check that the files of cases are those of a commitment.

    Raises
    ------
    InputError
        A file is missing, has been altered, or was never committed to.
    """
    file = cases / CASES_LIST
    text = read_input_text(file).replace("\r\n", "\n")
    if hashlib.sha256(text.encode()).hexdigest() != commitment.cases_hash:
        raise InputError(f"{file}: is not the list that {KEYS_LIST} names; fetch both again")
    listed = _parsed(text, file)
    for name, expected in listed.items():
        if not (cases / name).is_file() or _hash_of(cases / name) != expected:
            raise InputError(f"{cases / name}: is missing or not as it was published; fetch the cases again")
    names = {name.partition("/")[0] for name in listed}
    present = {path.relative_to(cases).as_posix() for path in _files_of_cases(cases, names)}
    if others := sorted(present - listed.keys()):
        raise InputError(f"{cases / others[0]}: is no part of the published set; take it away")


def _files_of_cases(cases: Path, names: Iterable[str]) -> list[Path]:
    return sorted(file for name in names for file in (cases / name).rglob("*") if file.is_file())


def _with_salt(file: Path) -> None:
    """Give a key a salt where it has none.

    Raises
    ------
    InputError
        Its salt is too short to hide anything.
    """
    text = read_input_text(file)
    stated = parse_toml(text, file)
    if "salt" not in stated:
        file.write_text(f'salt = "{secrets.token_hex(_SALT_BYTES)}"\n{text}', encoding="utf-8", newline="\n")
    elif not isinstance(stated["salt"], str) or len(stated["salt"]) < _SALT_BYTES:
        raise InputError(
            f"{file}: salt must be a text of {_SALT_BYTES} random characters at least; leave it out to be given one"
        )


def _list_of(folder: Path, files: Iterable[Path]) -> str:
    names = sorted(file.relative_to(folder).as_posix() for file in files)
    return "".join(f"{_hash_of(folder / name)}  {name}\n" for name in names)


def _hash_of(file: Path) -> str:
    """Return the SHA-256 of a file; of text with line ends as on Unix, which a version control may have turned."""
    content = read_input(file, MOST_TEXT_BYTES)
    if file.suffix in (".toml", ".csv"):
        content = content.replace(b"\r\n", b"\n")
    return hashlib.sha256(content).hexdigest()


def _parsed(text: str, file: Path) -> dict[str, str]:
    found: dict[str, str] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("#"):
            continue
        matched = _LINE.fullmatch(line)
        if matched is None or ".." in matched[2].split("/") or matched[2].startswith("/"):
            raise InputError(
                f"{file}:{number}: is no line of sha256sum with a path below this folder; fetch it again"
            )
        found[matched[2]] = matched[1]
    return found
