"""The errors that the estimator raises on purpose; every message is one line: what, where, what to do."""


class EstimatorError(Exception):
    """Base of everything that the estimator raises on purpose."""


class InputError(EstimatorError, ValueError):
    """A file or an argument that cannot be used as given."""


class SolverError(EstimatorError, ArithmeticError):
    """The equilibrium equations could not be solved."""


class FitError(EstimatorError):
    """The data do not determine the parameters, or the fit did not converge."""


class StudyError(EstimatorError):
    """The cases of a study could not all be carried out; what was done is kept."""


class WorkersLostError(EstimatorError):
    """The processes that worked on independent cases are gone; what they had finished is kept."""
