"""Stiff and extreme variants of a case: does the program hold, and how well?"""
