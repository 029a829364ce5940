"""The blind benchmark: cases with sealed answers, and how well the diagnosis names them."""
