"""What the schema of a kind of file finds in a text."""

import json
import tomllib
from functools import cache

from pmor.app.records import kind_of_sections
from pmor.app.start import schema_path


def kind_at_desk(document):
    """A kind of `FILES`."""
    kind = kind_of_sections(document)
    return "pair" if kind == "case" else kind


@cache
def validator(kind):
    from jsonschema import Draft7Validator

    schema = json.loads(schema_path(kind).read_text(encoding="utf-8"))
    Draft7Validator.check_schema(schema)
    return Draft7Validator(schema)


def faults(text, kind):
    """Sentences about what is wrong; a text that is no TOML, or has numbers that JSON lacks, is wrong too."""
    try:
        document = tomllib.loads(text)
        json.dumps(document, allow_nan=False, default=str)
    except (ValueError, RecursionError) as error:
        return [str(error)]
    return [f"{list(error.absolute_path)} {error.message}" for error in validator(kind).iter_errors(document)]
