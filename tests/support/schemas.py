"""What the schema of a kind of file finds in a text."""

import json
import tomllib
from functools import cache

from pmor.app.records import kind_of_sections
from pmor.app.start import schema_path

# Rules of the reader that no schema says, by words of its refusals, and why.
UNSEEN = {
    "must be a whole number without decimal point": "of JSON 21.0 is a whole number",
    "[shafts]: unknown section": "a gearbox file that a mesh names as its case is right by itself",
    "must be one line of printable text": "a pattern knows line breaks, not what is printable",
}


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


def sees(path):
    """Whether the schema of a file finds something wrong."""
    text = path.read_text(encoding="utf-8")
    try:
        kind = kind_at_desk(tomllib.loads(text))
    except (ValueError, RecursionError):
        return True
    return bool(faults(text, kind))
