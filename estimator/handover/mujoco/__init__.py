"""MuJoCo: the calibrated phantom as a flex, its quasi-static run, and in what its model is another."""
