"""A sweep on a Ray cluster: each task writes the parts of one shard into one result directory.

Ray runs a task again whose worker was lost; parts that are written stay.

    python ray_shards.py sweeps/workspace.toml results/workspace
"""

from __future__ import annotations

import sys
from pathlib import Path

import ray

import rodsweep


@ray.remote(max_retries=3)
def run_shard(shard: rodsweep.Shard, directory: str) -> int:
    """The task: samples that this call has solved."""
    return int(shard.run(directory, engine="cpu", threads=1, spot_check=False).account["solved"])


def run_on(sweep: rodsweep.Sweep, directory: str, shards: int) -> rodsweep.Results:
    """Runs a sweep on a cluster whose nodes see the directory."""
    first, *others = sweep.shards(shards)
    # The first shard settles engine and steps for all, in run.json.
    ray.get(run_shard.remote(first, directory))
    ray.get([run_shard.remote(shard, directory) for shard in others])
    return rodsweep.Results.open(directory)


if __name__ == "__main__":
    ray.init(num_cpus=3)
    results = run_on(rodsweep.Sweep.from_file(sys.argv[1]), str(Path(sys.argv[2]).resolve()), shards=12)
    print(results, results.status()["counts"])
