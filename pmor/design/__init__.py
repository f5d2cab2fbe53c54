"""Flank modifications searched for: what may vary, what is good, where to look, how it stands scatter."""
