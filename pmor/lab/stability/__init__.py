"""Stiff and extreme variants of a case: does the program hold, and how well?

Above the study, below the commands; like it, it uses both stages.
"""
