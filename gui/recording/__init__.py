"""What is to be recorded: the operator's queue, how a motion will look, problems while it is recorded."""
