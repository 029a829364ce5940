"""Tells what is wrong or suspicious in an experiment folder before anything is solved."""

from estimator.experiment_checks.checking import CHECKS, Checked, check_folder, findings_of
from estimator.experiment_checks.finding import Finding, Grade

__all__ = ["CHECKS", "Checked", "Finding", "Grade", "check_folder", "findings_of"]
