"""JSON schema of cases, sweeps and fits, with which editors complete and check them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

from workflow.case.sections import Section

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema(models: Mapping[str, tuple[type[Section], str]]) -> dict[str, Any]:
    """Return the schema (draft 2020-12) of a file of any of these models.

    ``models`` has a model and a line about it for each name. Exactly one model fits a file: the
    fixed words of its analysis and of the kind and shape of its structure decide, and the entries
    that only one model has.
    """
    inputs: Any = [(name, "validation", TypeAdapter(model)) for name, (model, _) in models.items()]
    made, schema = TypeAdapter.json_schemas(inputs, schema_generator=_Generator)
    definitions = schema["$defs"]
    for (name, _), reference in made.items():
        definition = definitions[str(reference["$ref"]).rpartition("/")[2]]
        definition |= {"title": str(name), "description": models[str(name)][1]}
    return {
        "$schema": DIALECT,
        "title": "fretscale",
        "description": "A case of fretscale, a sweep or a fit: `fretscale new` lists the kinds.",
        "type": "object",
        "oneOf": list(made.values()),
        "$defs": definitions,
    }


class _Generator(GenerateJsonSchema):
    """Generator that leaves out redundant parts: titles made from keys, and null as a default."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def default_schema(self, schema: Any) -> dict[str, Any]:
        made = super().default_schema(schema)
        if made.get("default", ...) is None:
            del made["default"]
        return made

    def model_schema(self, schema: Any) -> dict[str, Any]:
        made = super().model_schema(schema)
        made.pop("title", None)
        return {**made, **schema["cls"].in_schema}
