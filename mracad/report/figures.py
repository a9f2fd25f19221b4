"""The pictures of reports."""

from __future__ import annotations

import base64
import io

from PIL import Image

from mracad.occ.document import Document
from mracad.report.page import Figure
from mracad.spec.pictures import Picture
from mracad.view.picture import Rendered, render

SIZE = "960x640"
"""Of pictures of one model, pixels."""

PAIR = "1440x600"
"""Of two models side by side, pixels."""

THUMBNAIL, QUALITY = 96, 70
"""Height of small pictures, pixels, and their quality as JPEG."""

BEFORE = "before"
"""What a reference with the model's own name is called."""

ALONE = {
    "zebra": "Zebra stripes: they break at creases, and kink at tangent joints whose curvatures differ",
    "curvature:max": "Larger principal curvature, without its sign",
    "curvature:mean": "Mean curvature, positive where convex",
    "faces": "Faces and their numbers",
}
"""What is shown of one model, and its captions."""


def still(document: Document) -> Figure:
    """The model in soft light."""
    return Figure(f"{document.name}, shaded", render(document, Picture(size=SIZE)).data)


def alone(document: Document, without: str = "") -> list[Figure]:
    """Pictures of one model."""
    return [
        Figure(caption, render(document, Picture(show=show, size=SIZE)).data)
        for show, caption in ALONE.items()
        if show != without
    ]


def both(document: Document, before: Document) -> list[Figure]:
    """Pictures of a model beside another, and of its deviation from that."""
    stripes = render(document, Picture(show="zebra", size=PAIR), before=before)
    moved = render(document, Picture(show="deviation", size=SIZE), reference=before)
    name = reference_name(document, before)
    names = "before and after" if name == BEFORE else f"{name} and {document.name}"
    return [
        Figure(f"Zebra stripes: {names}", stripes.data, wide=True),
        Figure(f"Deviation from {name}, {_range(moved)}, positive outside", moved.data),
    ]


def reference_name(document: Document, reference: Document | None) -> str:
    """What is said of a reference; ``""`` if there is none."""
    if reference is None:
        return ""
    return BEFORE if reference.name == document.name else reference.name


def thumbnail(figure: Figure) -> str:
    """A small copy of a picture, as an address that holds it."""
    whole = Image.open(io.BytesIO(figure.data)).convert("RGB")
    small = whole.resize((round(whole.width * THUMBNAIL / whole.height), THUMBNAIL), Image.Resampling.LANCZOS)
    packed = io.BytesIO()
    small.save(packed, "JPEG", quality=QUALITY, optimize=True)
    return f"data:image/jpeg;base64,{base64.b64encode(packed.getvalue()).decode()}"


def _range(drawn: Rendered) -> str:
    return f"{drawn.lowest:.3g} to {drawn.highest:.3g} {drawn.unit} in the pixels".replace("-", "−")
