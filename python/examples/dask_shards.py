"""A sweep on a Dask cluster: each task writes the parts of one shard into one result directory.

A worker that is lost loses nothing: Dask gives its shards to others, parts that are written stay, the others are
solved again. No row is there twice, since a part is one file.

    python dask_shards.py sweeps/workspace.toml results/workspace
"""

from __future__ import annotations

import sys
from pathlib import Path

from distributed import Client, LocalCluster

import rodsweep


def run_shard(shard: rodsweep.Shard, directory: str) -> int:
    """The task: samples that this call has solved."""
    return int(shard.run(directory, engine="cpu", threads=1, spot_check=False).account["solved"])


def run_on(client: Client, sweep: rodsweep.Sweep, directory: str, shards: int) -> rodsweep.Results:
    """Runs a sweep on a cluster whose workers see the directory."""
    first, *others = sweep.shards(shards)
    # The first shard settles engine and steps for all, in run.json.
    client.submit(run_shard, first, directory, pure=False, retries=3).result()
    futures = [client.submit(run_shard, shard, directory, pure=False, retries=3) for shard in others]
    client.gather(futures)
    return rodsweep.Results.open(directory)


if __name__ == "__main__":
    sweep = rodsweep.Sweep.from_file(sys.argv[1])
    with LocalCluster(n_workers=3, threads_per_worker=1) as cluster, Client(cluster) as client:
        results = run_on(client, sweep, str(Path(sys.argv[2]).resolve()), shards=12)
        print(results, results.status()["counts"])
