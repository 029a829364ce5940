"""The rig as the window knows it: which one, its link, its state, its disk, the beads before its cameras."""
