"""A file as rows of cells: decoded, parted into columns, its numbers told."""
