#!/usr/bin/env python3
"""check_schema.py SCHEMA.json FILE.json: status 1, with the place, where the file breaks the schema.

Knows the words of JSON Schema that docs/chart-schema.json uses, and refuses any other.
"""
import json
import re
import sys

TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}
IGNORED = {"$schema", "$defs", "title"}


def is_type(value, name):
    if name in ("number", "integer"):
        return isinstance(value, (int,) if name == "integer" else (int, float)) and not isinstance(value, bool)
    return isinstance(value, TYPES[name])


def breaches(schema, value, root, place="$"):
    """Yields a sentence per breach."""
    for word, rule in schema.items():
        if word in IGNORED:
            continue
        if word == "$ref":
            target = root
            for name in rule.removeprefix("#/").split("/"):
                target = target[name]
            yield from breaches(target, value, root, place)
        elif word == "type":
            names = rule if isinstance(rule, list) else [rule]
            if not any(is_type(value, name) for name in names):
                yield f"{place}: expected {' or '.join(names)}, got {json.dumps(value)[:60]}"
        elif word == "const":
            if value != rule:
                yield f"{place}: expected {json.dumps(rule)}"
        elif word == "enum":
            if value not in rule:
                yield f"{place}: expected one of {json.dumps(rule)}"
        elif word == "required":
            if isinstance(value, dict):
                yield from (f"{place}: lacks {name}" for name in rule if name not in value)
        elif word == "properties":
            if isinstance(value, dict):
                for name, part in rule.items():
                    if name in value:
                        yield from breaches(part, value[name], root, f"{place}.{name}")
        elif word == "additionalProperties":
            if isinstance(value, dict):
                for name in value.keys() - schema.get("properties", {}).keys():
                    if rule is False:
                        yield f"{place}: nothing is called {name}"
                    else:
                        yield from breaches(rule, value[name], root, f"{place}.{name}")
        elif word == "items":
            if isinstance(value, list):
                for k, part in enumerate(value):
                    yield from breaches(rule, part, root, f"{place}[{k}]")
        elif word in ("minItems", "maxItems"):
            if isinstance(value, list) and (len(value) < rule if word == "minItems" else len(value) > rule):
                yield f"{place}: {len(value)} items, {word} is {rule}"
        elif word in ("minimum", "maximum"):
            if is_type(value, "number") and (value < rule if word == "minimum" else value > rule):
                yield f"{place}: {value}, {word} is {rule}"
        elif word == "pattern":
            if isinstance(value, str) and not re.search(rule, value):
                yield f"{place}: {value!r} does not match {rule}"
        else:
            raise SystemExit(f"check_schema.py does not know the word {word}")


def main():
    schema, document = (json.load(open(path, encoding="utf-8")) for path in sys.argv[1:3])
    found = list(breaches(schema, document, schema))
    for line in found[:20]:
        print(line)
    sys.exit(1 if found else 0)


main()
