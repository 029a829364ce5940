"""Files of volume meshes: read with every element checked, and written, with their regions."""
