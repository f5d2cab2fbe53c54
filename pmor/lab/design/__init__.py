"""Modifications designed: samples, descents and trade-offs of a design file, on the reduced model itself."""
