"""The words of HyperQueue's `hq` that granchain uses, handed to the client of its wheel; `serve` is the server with two workers of one core each.

For tests/cluster/hyperqueue alone: the engine is the real one, the command line is not. Any word that the documentation of `hq` does not have in this
place is refused.
"""

import os
import pathlib
import sys
import time

from hyperqueue import Job, LocalCluster
from hyperqueue.client import Client
from hyperqueue.cluster import WorkerConfig
from hyperqueue.ffi.protocol import ResourceRequest

SERVER = pathlib.Path(os.environ["HQ_SERVER_DIR"])


def serve():
    cluster = LocalCluster(str(SERVER))
    for _ in range(2):
        cluster.start_worker(WorkerConfig(cores=1))
    (SERVER / "ready").touch()
    while True:
        time.sleep(1)


def submit(words):
    options, run = {}, words[words.index("--") + 1 :]
    for word in words[: words.index("--")]:
        name, _, value = word.removeprefix("--").partition("=")
        if not word.startswith("--") or name not in ("array", "wait") or (name == "array") != bool(value):
            sys.exit(f"hq submit: unexpected `{word}`")
        options[name] = value
    first, _, last = options["array"].partition("-")
    job = Job(max_fails=None)
    for number in range(int(first), int(last) + 1):
        # The wheel numbers tasks itself.
        job.program(["/usr/bin/env", f"HQ_TASK_ID={number}", *run], resources=ResourceRequest(cpus="1"), stdout=None, stderr=None)
    client = Client(str(SERVER))
    # Fails, as `hq submit --wait` does, where a task failed.
    client.wait_for_jobs([client.submit(job)])


def main(words):
    if words == ["serve"]:
        serve()
    elif words[:1] == ["submit"]:
        submit(words[1:])
    else:
        sys.exit(f"hq: unexpected {words}")


main(sys.argv[1:])
