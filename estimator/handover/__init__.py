"""What an estimation or a diagnosis has found, handed over to other simulators, and their answers compared with ours."""
