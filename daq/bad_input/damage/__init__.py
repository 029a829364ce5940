"""What befalls a file: damage to any, to its layout, to its values, and what may stand in its place."""
