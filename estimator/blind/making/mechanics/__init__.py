"""The simulator of the maker: bodies, laws, what is remembered, how they are held, equilibrium."""
