"""The only room that talks to the CAD kernel: documents in, Models out, edits applied, results checked and written."""

from mracad.occ.apply import apply
from mracad.occ.check import Failure, Validity, check
from mracad.occ.document import Document
from mracad.occ.files import read, write
from mracad.occ.select import select_cq
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view

__all__ = [
    "Document",
    "Failure",
    "Validity",
    "apply",
    "check",
    "read",
    "read_step",
    "select_cq",
    "view",
    "write",
    "write_step",
]
