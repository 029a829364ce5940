"""Phantoms of any closed shape: surfaces, the regions that hold them, and tetrahedral meshes of what lies inside."""
