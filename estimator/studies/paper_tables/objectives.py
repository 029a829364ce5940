"""The two objectives that studies compare, in words."""

from estimator.fit.settings import Objective

OBJECTIVES: dict[Objective, str] = {
    "paper": "by the paper's objective",
    "likelihood": "by the likelihood",
}
