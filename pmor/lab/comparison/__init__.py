"""Reductions and samplings of a case, compared with full FE at equal conditions.

Above the study, below the commands, like the stability matrix; it uses both stages.
"""
