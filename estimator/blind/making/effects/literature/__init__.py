"""Forms of the catalogue's labels as the literature has them, written apart from how the catalogue models them."""
