"""The words of HyperQueue's `hq` that granchain uses, handed to the client of its wheel; `serve` is the server with two workers of one core each.

For tests/cluster/hyperqueue alone: the engine is the real one, the command line is not. Any word that the documentation of `hq` does not have in this
place is refused.
"""

import json
import os
import pathlib
import sys
import time

from hyperqueue import Job, LocalCluster
from hyperqueue.client import Client
from hyperqueue.cluster import WorkerConfig
from hyperqueue.ffi.protocol import ResourceRequest

SERVER = pathlib.Path(os.environ["HQ_SERVER_DIR"])
JOBS = SERVER / "jobs"


def serve():
    cluster = LocalCluster(str(SERVER))
    for _ in range(2):
        cluster.start_worker(WorkerConfig(cores=1))
    (SERVER / "ready").touch()
    while True:
        time.sleep(1)


def numbers(text):
    for part in text.split(","):
        first, _, last = part.partition("-")
        yield from range(int(first), int(last or first) + 1)


def submit(words):
    options, run = {"array": "0"}, words[words.index("--") + 1 :]
    for word in words[: words.index("--")]:
        name, _, value = word.removeprefix("--").partition("=")
        if not word.startswith("--") or not value or name not in ("array", "name", "cpus", "stdout", "stderr"):
            sys.exit(f"hq submit: unexpected `{word}`")
        options[name] = value
    job = Job(name=options.get("name"), max_fails=None)
    resources = ResourceRequest(cpus=int(options.get("cpus", "1")))
    output = {name: None if options.get(name) == "none" else options.get(name) for name in ("stdout", "stderr")}
    for number in numbers(options["array"]):
        # The wheel numbers tasks itself.
        job.program(["/usr/bin/env", f"HQ_TASK_ID={number}", *run], resources=resources, **output)
    number = Client(str(SERVER)).submit(job).id
    with JOBS.open("a") as jobs:
        print(number, file=jobs)
    print(number)


def unfinished():
    jobs = [int(line) for line in JOBS.read_text().split()] if JOBS.exists() else []

    def told(states):
        print(json.dumps([{"id": number} for number, state in states.items() if not state["completed"]]), flush=True)
        os._exit(0)

    if jobs:
        Client(str(SERVER)).connection.wait_for_jobs(jobs, told)
    print("[]")


def main(words):
    if words == ["serve"]:
        serve()
    elif words[:2] == ["--output-mode=quiet", "submit"]:
        submit(words[2:])
    elif words == ["--output-mode=json", "job", "list", "--filter", "waiting,running"]:
        unfinished()
    else:
        sys.exit(f"hq: unexpected {words}")


main(sys.argv[1:])
