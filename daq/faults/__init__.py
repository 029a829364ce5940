"""Complete sessions on the virtual rig with a fault at a random instant, judged by what is right for that fault.

:mod:`daq.faults.catalogue` lists the faults, :mod:`daq.faults.trial` carries out one session with one of them,
:mod:`daq.faults.checks` judges what came of it, :mod:`daq.faults.campaign` does that many times.
"""
