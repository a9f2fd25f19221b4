"""The JSON schema of recipes, and the documentation page of all steps and options."""

from __future__ import annotations

import json
from typing import Any

import msgspec

from mracad.spec.fields import dashed, fields
from mracad.spec.quantity import Kind
from mracad.spec.recipe import OWN
from mracad.spec.steps import STEPS, Options


def schema() -> dict[str, Any]:
    """The JSON schema of recipes."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "mracad recipe",
        "type": "object",
        "properties": {
            "step": {
                "type": "array",
                "minItems": 1,
                "items": {"oneOf": [{"$ref": f"#/$defs/{use}"} for use in STEPS]},
            },
            "versions": {"type": "object", "description": "What made a recorded recipe; for information."},
        },
        "required": ["step"],
        "additionalProperties": False,
        "$defs": {use: _step_schema(use, struct) for use, struct in STEPS.items()},
    }


def _step_schema(use: str, struct: type[Options]) -> dict[str, Any]:
    own = {
        "use": {"const": use},
        "id": {"type": "string", "description": "The step's name, for --set and reports."},
    }
    body = msgspec.json.schema(struct)["$defs"][struct.__name__]
    properties = {
        dashed(name): _property(part, fields(struct)[name].quantity) for name, part in body["properties"].items()
    }
    return {
        "description": body["description"],
        "type": "object",
        "properties": {**own, **properties},
        "required": ["use", *map(dashed, body.get("required", []))],
        "additionalProperties": False,
    }


def _property(part: dict[str, Any], quantity: Kind | None) -> dict[str, Any]:
    """The schema of an option: no null, which TOML lacks; quantities may be numbers, and lists a single text."""
    kinds = [kind for kind in part.get("anyOf", []) if kind != {"type": "null"}]
    found = {key: value for key, value in part.items() if key != "anyOf" and value is not None}
    found |= kinds[0] if len(kinds) == 1 else {"anyOf": kinds} if kinds else {}
    if quantity:
        found["type"] = ["string", "number"]
    elif found.get("type") == "array":
        extra = {key: found.pop(key) for key in ("type", "items")}
        found["anyOf"] = [extra, extra["items"]]
    return found


def page() -> str:
    """Every step with its options, as the Markdown page ``docs/steps.md``."""
    lines = ["# Steps of recipes", "", "Made by `make docs` from `mracad/spec/steps`; see [recipes](recipes.md).", ""]
    for use, definition in schema()["$defs"].items():
        lines += [f"## {use}", "", definition["description"], "", "| option | default | |", "|---|---|---|"]
        for name, part in definition["properties"].items():
            if name not in OWN:
                default = json.dumps(part["default"]) if "default" in part else ""
                words = f"`{'`, `'.join(part['enum'])}`: " if "enum" in part else ""
                text = (words + part.get("description", "")).replace("|", "\\|")
                lines.append(f"| `{name}` | {f'`{default}`' if default else ''} | {text} |")
        lines.append("")
    return "\n".join(lines)
