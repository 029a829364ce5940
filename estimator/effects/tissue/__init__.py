"""What the tissue is made of and how it was mounted: its law, its memory, its inhomogeneity, its shape at rest."""
