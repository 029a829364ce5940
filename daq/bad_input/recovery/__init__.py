"""Damaged sessions are recovered: what was recorded, and whether what comes of the damage is right."""
