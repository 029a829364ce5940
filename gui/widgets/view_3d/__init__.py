"""Bodies and ways in three dimensions, turned by mouse and keys."""
