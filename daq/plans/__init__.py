"""Plans: several trials in order, each repeated, named by a template, and resumed after an interruption.

A plan file is TOML::

    format = "retraction-plan/1"
    sessions = "sessions"                    # folder of the session folders
    name = "{date}_{phantom}_{trial:02d}_{trajectory}_{repeat}"
    operator = "N. N."

    [[trials]]
    trajectory = "pull"                      # a name, a table "mine.csv", or a function "mine.py:spiral"
    repeat = 3
    holds_s = [3.0, 8.0]

What has been recorded is written into a journal beside the plan, so that the next run begins with the first trial that
is not finished. A trial whose parameters were edited counts as a new one; trials may be added anywhere.
"""

from daq.plans.plan import NAME_TEMPLATE, Plan, read_plan
from daq.plans.runs import Run, due_runs, finished, journal_path, new_folder, run_plan, runs
from daq.plans.trial import Trial

__all__ = [
    "NAME_TEMPLATE",
    "Plan",
    "Run",
    "Trial",
    "due_runs",
    "finished",
    "journal_path",
    "new_folder",
    "read_plan",
    "run_plan",
    "runs",
]
