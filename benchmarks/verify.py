"""The cost of verification compared with one read of the file: python benchmarks/verify.py FILE…

Processor time of reading a model, of reading its output back, and of judging that.
"""

from __future__ import annotations

import io
import statistics
import sys
import time
from pathlib import Path

from mracad.inspect import accept
from mracad.occ.facts import facts
from mracad.occ.files import read, write
from mracad.occ.load import Text


def measure(path: Path) -> tuple[float, float, float]:
    """Seconds of reading, of reading back and of judging."""
    start = time.process_time()
    document = read(path)
    done = time.process_time()
    stream = io.BytesIO()
    written = write(document, stream, "step")
    again = time.process_time()
    back = read(Text(stream.getvalue(), path.name))
    judged = time.process_time()
    memory, file = facts(document), facts(back)
    slack = accept.Slack(parts={cut.face: cut.parts for cut in written.cut})
    accept.read_back(file, *accept.judge(memory, file, slack))
    return done - start, judged - again, time.process_time() - judged


def main() -> None:
    files = [Path(word) for word in sys.argv[1:]]
    measure(files[0])  # loads libraries
    ratios = []
    for path in files:
        read, back, judged = (min(each) for each in zip(*(measure(path) for _ in range(3)), strict=True))
        ratios.append(((back + judged) / read, judged / read))
        print(f"{path.stem:32} read {read:.2f} s; read back {back / read:.2f} x, judged {judged / read:.2f} x")
    whole, judging = (statistics.median(each) for each in zip(*ratios, strict=True))
    print(f"median: verified in {whole:.2f} x the time of a read, of which judging {judging:.2f} x")


if __name__ == "__main__":
    main()
