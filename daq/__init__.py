"""The laboratory: rig, clocks, recordings, vision, trajectories, sessions, the virtual rig and the command line."""
