"""On the path of a process, this makes files whose text says so crash, hang or eat memory; or all work a mere sham."""

import hashlib
import json
import os
import signal
import time

from mracad.job.batch import work

real = work.do


def do(task) -> work.Product:
    if b"/* crash */" in task.data:
        os.kill(os.getpid(), signal.SIGSEGV)
    if b"/* eat */" in task.data:
        eaten = []
        while True:
            eaten.append(b"x" * 20_000_000)
    if b"/* hang */" in task.data:
        from mracad.occ import files

        files.read = lambda *_: time.sleep(600)
    if not os.environ.get("SHAM"):
        return real(task)
    time.sleep(float(os.environ["SHAM"]))
    page = b""
    if task.pages:
        row = json.dumps({"key": task.key, "deviation": 0.5, "pictures": ["data:,"]})
        page = f'<script type="application/json" id="row">{row}</script>'.encode()
    return work.Product(hashlib.sha256(task.data).hexdigest().encode() * 2000, (), (), 0.0, page=page)


work.do = do
if os.environ.get("SHAM"):
    work.warm = bool
