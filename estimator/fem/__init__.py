"""The forward model: large-deformation finite elements, driven by the gripper, with exact sensitivities."""
