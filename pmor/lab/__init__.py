"""Roof: experiments on the program itself. Laboratories share `core`, and do not know each other."""
