"""Results of a sweep and the figures derived from them."""
