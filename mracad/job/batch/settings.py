"""Settings of a batch; they load no numerical library."""

from __future__ import annotations

from dataclasses import dataclass, field

from mracad.spec.pictures import Scalars


@dataclass(frozen=True)
class Limits:
    """What one task may use.

    Attributes
    ----------
    seconds : float
    memory : int
        Bytes that the worker may occupy; 0 for its share of four fifths of the machine's memory.
    """

    seconds: float = 600.0
    memory: int = 0


@dataclass(frozen=True)
class Settings:
    """How the files of a batch are read and written.

    Attributes
    ----------
    input_unit, encoding : str or None
    schema : str or None
        Of STEP files; by default AP242 for a file in AP242, else AP214.
    chord, angle, ascii_stl, scalars
        Of meshes; see :class:`mracad.job.output.Target`.
    verify : bool
        Read each output back and judge it.
    overwrite : bool
        Replace files in the output folder that were not made by a batch.
    if_changed : bool
        Do not touch outputs whose content would stay the same.
    record : bool
        Write the resolved recipe beside each output.
    retry : int
        Number of further attempts after a crash or a limit.
    keep_going : bool
        Go on after a file has failed.
    """

    input_unit: str | None = None
    encoding: str | None = None
    schema: str | None = None
    chord: str = "0.02%"
    angle: float = 12.0
    ascii_stl: bool = False
    scalars: Scalars = field(default_factory=Scalars)
    verify: bool = True
    overwrite: bool = False
    if_changed: bool = False
    record: bool = False
    retry: int = 0
    keep_going: bool = True
