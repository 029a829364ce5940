"""The file formats of surfaces; every reader gives a polygon soup in the file's unit."""
