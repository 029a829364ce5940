"""Readers of file formats: each returns tables of named columns, and knows nothing of experiments."""
