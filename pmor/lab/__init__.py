"""Roof: experiments on the program itself."""
