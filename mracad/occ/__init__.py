"""The only room that talks to the CAD kernel: documents in, Models out, edits applied, results checked and written."""

from mracad.occ.apply import apply
from mracad.occ.check import Failure, Validity, check
from mracad.occ.document import Document
from mracad.occ.mesh import write_stl
from mracad.occ.read import read_step
from mracad.occ.select import select_cq
from mracad.occ.view import view
from mracad.occ.write import write_step

__all__ = [
    "Document",
    "Failure",
    "Validity",
    "apply",
    "check",
    "read_step",
    "select_cq",
    "view",
    "write_step",
    "write_stl",
]
