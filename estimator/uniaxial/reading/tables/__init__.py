"""Where the tables of a file stand, which of their columns are used, and the curve in them."""
