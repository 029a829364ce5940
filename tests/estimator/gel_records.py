"""Files of a gel's tests, and what is read of them."""

from pathlib import Path

from daq.bad_input.samples.machine_exports import gel_test
from estimator.materials import LAWS
from estimator.uniaxial import Stated, UniaxialRecord, fit_record, read_record

PULLED = gel_test()


def read(
    folder: Path, content: str | bytes, stated: Stated | None = None, name: str = "test.csv"
) -> UniaxialRecord:
    file = folder / name
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_record(file, stated or Stated())


def modulus(record: UniaxialRecord) -> float:
    return fit_record(record, [LAWS["neo_hookean"]]).best.fit.youngs_modulus.value


def table(names: str, *columns: object, separator: str = ",", decimal: str = ".", digits: int = 6) -> str:
    rows = zip(*columns, strict=True)
    lines = [separator.join(f"{value:.{digits}f}".replace(".", decimal) for value in row) for row in rows]
    return "\n".join([names, *lines, ""])
