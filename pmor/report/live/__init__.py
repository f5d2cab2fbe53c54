"""The live page: the report carries the reduced model of line loads itself, and solves it in the browser."""
