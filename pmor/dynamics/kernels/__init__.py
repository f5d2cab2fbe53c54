"""Compiled dynamics: force laws, integration over time, growth of a disturbance over a period."""
