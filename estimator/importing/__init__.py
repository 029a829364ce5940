"""Imports the measurements of others: files of many formats, by a mapping, as experiment folders."""

from estimator.importing.formats.opening import read_source
from estimator.importing.importing import Imported, import_experiment
from estimator.importing.table import Column, Source, Table

__all__ = ["Column", "Imported", "Source", "Table", "import_experiment", "read_source"]
