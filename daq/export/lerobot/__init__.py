"""Sessions as a LeRobot dataset, v3.0: the format that programs of robot learning read."""
