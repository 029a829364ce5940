"""Reads records of testing machines: layouts, units, columns, facts and sheets."""

from estimator.uniaxial.reading.language.units import stated_quantity
from estimator.uniaxial.reading.record import read_record
from estimator.uniaxial.reading.stated import Stated

__all__ = ["Stated", "read_record", "stated_quantity"]
