"""What an estimation or a diagnosis has found, handed over to other simulators; their answers beside ours."""
