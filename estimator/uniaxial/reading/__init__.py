"""Reads records of testing machines: layouts, units, columns, facts and sheets."""

from estimator.uniaxial.reading.record import read_record
from estimator.uniaxial.reading.stated import Stated
from estimator.uniaxial.reading.units import stated_quantity

__all__ = ["Stated", "read_record", "stated_quantity"]
