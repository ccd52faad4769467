"""The case file: YAML with units in, a frozen ``Case`` in base units out, or why not."""

from workflow.case.loading import load_case, parse_case
from workflow.case.schema import Case
from workflow.case.template import KINDS, template
from workflow.case.writing import dump_case
from workflow.errors import CaseError

__all__ = ["KINDS", "Case", "CaseError", "dump_case", "load_case", "parse_case", "template"]
