"""Forces on the tissue besides its own stress, and stresses that are added to it."""
