"""Numbers on pictures: each on what it names, none over another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mracad.view.panel import Panel
from mracad.view.runs import groups

Array = np.ndarray

LEAST = 220
"""Number of pixels of a face from which its number is drawn on it."""

_SPOTS = 24  # places that are tried for a number
_GAP = 2  # pixels between numbers


@dataclass(frozen=True, eq=False)
class Label:
    """A text, and places for its middle, the best first, ``(k, 2)`` pixels."""

    text: str
    spots: Array


def of_faces(panel: Panel) -> tuple[list[Label], int]:
    """The numbers of faces that are seen, the largest first, and how many faces are too small for theirs."""
    width = panel.stage.camera.size[0]
    found: dict[int, Array] = {}
    order = np.argsort(panel.entry, kind="stable")
    for own in (order[stretch] for stretch in groups(panel.entry[order])):
        face = panel.stage.entries[panel.entry[own[0]]][2].face
        if len(own) > len(found.get(face, ())):
            found[face] = own
    large = sorted((face for face in found if len(found[face]) >= LEAST), key=lambda face: -len(found[face]))
    labels = []
    for face in large:
        at = np.stack(np.divmod(panel.pixel[found[face]], width)[::-1], axis=1)
        inward = np.argsort(((at - at.mean(axis=0)) ** 2).sum(axis=1), kind="stable")
        labels.append(Label(f"#{face + 1}", at[inward[:: -(-len(inward) // _SPOTS)]]))
    return labels, len(found) - len(large)


def placed(
    labels: Sequence[Label], size: Callable[[str], tuple[int, int]], window: Array
) -> tuple[list[tuple[str, int, int]], int]:
    """Texts with their middles, and how many found no place.

    Parameters
    ----------
    labels : sequence of Label
        Those that matter most first.
    size : callable
        Width and height of a text, pixels.
    window : ndarray (2, 2)
        Least and largest x and y that texts may take.
    """
    taken = np.empty((0, 2, 2))
    found = []
    for label in labels:
        half = 0.5 * np.array(size(label.text)) + _GAP
        for spot in _within(label.spots, half, window):
            box = np.array([spot - half, spot + half])
            if ((box[1] <= taken[:, 0]) | (box[0] >= taken[:, 1])).any(axis=1).all():
                taken = np.concatenate([taken, box[None]])
                found.append((label.text, int(spot[0]), int(spot[1])))
                break
    return found, len(labels) - len(found)


def _within(spots: Array, half: Array, window: Array) -> Iterable[Array]:
    """The places whose text is inside a window."""
    return np.asarray(spots[((spots >= window[0] + half) & (spots <= window[1] - half)).all(axis=1)])
