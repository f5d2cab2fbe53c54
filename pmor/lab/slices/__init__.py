"""Thin slices: motion of a pair with and without the coupling of its teeth and sections; an experiment."""
