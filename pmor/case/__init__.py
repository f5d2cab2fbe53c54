"""Case files: strict TOML in, frozen dataclasses out.

Lengths carry their unit in the name of the key; those without one are in (normal) modules.
"""

from pmor.case.change import change_case, changed_text, for_motion, make_case, text_of, without_models
from pmor.case.checks import refuse_uneven_load
from pmor.case.describe import basis_key, basis_settings, condition_words, describe, short_list
from pmor.case.dynamics import DynamicsCase
from pmor.case.extrapolation import beyond_training
from pmor.case.flanks import check_flanks, trained_flanks
from pmor.case.gears import GearCase
from pmor.case.loader import load_case, parse_case
from pmor.case.models import model_names, of_linear_elements, other_models
from pmor.case.schema import Case, ConditionCase, OfflineCase

__all__ = [
    "Case", "ConditionCase", "DynamicsCase", "GearCase", "OfflineCase", "basis_key", "basis_settings",
    "beyond_training", "change_case", "changed_text", "check_flanks", "condition_words", "describe", "for_motion",
    "load_case", "make_case", "model_names", "of_linear_elements", "other_models", "parse_case", "refuse_uneven_load",
    "short_list", "text_of", "trained_flanks", "without_models"
]  # fmt: skip
