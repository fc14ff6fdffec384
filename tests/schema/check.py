"""Holds TOML files against a JSON Schema, by two programs that know nothing of rungd.

    check.py SCHEMA.json good|bad FILE.toml…

Prints a line for each file that is not what it should be, and exits with 1 if there was one.
"""

import json
import sys
import tomllib

import jsonschema

schema = json.load(open(sys.argv[1], encoding="utf-8"))
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)
wrong = 0
for path in sys.argv[3:]:
    with open(path, "rb") as file:
        errors = [error.message for error in validator.iter_errors(tomllib.load(file))]
    if bool(errors) == (sys.argv[2] == "good"):
        wrong += 1
        print(f"{path}: {errors[0] if errors else 'nothing is found wrong'}")
sys.exit(wrong > 0)
