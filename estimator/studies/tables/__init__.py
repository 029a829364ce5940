"""A study as levels of cases, and its tables, pictures and page."""
