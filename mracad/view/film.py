"""Pictures one after the other, as a GIF or as an MP4."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from mracad.errors import needing

RATE = 12
"""Pictures in a second."""

_SAMPLE = 6, 4  # every so many pictures, and pixels of them, choose the colours of a GIF
_MP4 = "-crf 18 -preset medium -threads 1 -fflags +bitexact -flags:v +bitexact -map_metadata -1 -movflags +faststart"


def packed(frames: Sequence[Image.Image], format: str) -> bytes:
    """The file of pictures: of the first alone as PNG, of all as GIF or MP4; raises UsageError."""
    if format == "mp4":
        return _mp4(frames)
    stream = io.BytesIO()
    if format == "gif":
        every, fine = _SAMPLE
        tiles = [np.asarray(frame)[::fine, ::fine] for frame in frames[::every]]
        colours = Image.fromarray(np.concatenate(tiles)).quantize(256, Image.Quantize.MEDIANCUT)
        first, *rest = [frame.quantize(palette=colours, dither=Image.Dither.NONE) for frame in frames]
        first.save(stream, "GIF", save_all=True, append_images=rest, duration=round(1000 / RATE), loop=0)
    else:
        frames[0].save(stream, "PNG")
    return stream.getvalue()


def _mp4(frames: Sequence[Image.Image]) -> bytes:
    with needing("video", "cannot write MP4"):
        import imageio_ffmpeg
    width, height = (side // 2 * 2 for side in frames[0].size)  # the format holds colours of every second pixel
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mp4"
        writer = imageio_ffmpeg.write_frames(
            str(path), (width, height), fps=RATE, codec="libx264", macro_block_size=2, output_params=_MP4.split()
        )
        writer.send(None)
        for frame in frames:
            writer.send(np.ascontiguousarray(np.asarray(frame)[:height, :width]))
        writer.close()
        return path.read_bytes()
