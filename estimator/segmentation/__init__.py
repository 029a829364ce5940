"""From a segmented image to the phantom: label maps, their smooth surfaces, and the way to the tissue frame."""
