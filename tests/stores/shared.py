"""Workers that share a run: `shared.py directory|clocks|bucket|formats|container PROGRAM FOLDER ROUNDS`.

One of three workers is killed with SIGKILL once some parts are there; of `formats`, a second one later. Then every part has to
be there, byte for byte as in a run alone, and no claim of a living worker may have been taken over.
"""

import glob
import json
import logging
import os
import random
import signal
import socket
import subprocess
import sys
import time

SWEEP = os.path.join(os.path.dirname(os.path.abspath(__file__)), "sweep.toml")
PART = ["--part-size", "500"]
SILENCE = 3


def start(program, sweep, out, environment=None):
    command = [program, "run", sweep, "--out", out, "--join", "--silence", str(SILENCE), "--backend", "cpu"]
    environment = dict(os.environ, RAYON_NUM_THREADS="1", **(environment or {}))
    command += PART + ["--no-figures", "--quiet"]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


class Directory:
    """Files of a result directory."""

    def __init__(self, path):
        self.path = path

    def names(self, folder=""):
        return [os.path.basename(p) for p in glob.glob(os.path.join(self.path, folder, "*")) if os.path.isfile(p)]

    def read(self, name):
        with open(os.path.join(self.path, name), "rb") as file:
            return file.read()

    def time(self, name):
        return os.stat(os.path.join(self.path, name)).st_mtime


class Bucket:
    """Files of a place in a bucket, asked for past the proxy."""

    def __init__(self, client, bucket, prefix):
        self.client, self.bucket, self.prefix = client, bucket, prefix

    def names(self, folder=""):
        prefix = f"{self.prefix}/{folder + '/' if folder else ''}"
        pages = self.client.get_paginator("list_objects_v2").paginate(Bucket=self.bucket, Prefix=prefix, Delimiter="/")
        return [item["Key"].rsplit("/", 1)[1] for page in pages for item in page.get("Contents", [])]

    def read(self, name):
        return self.client.get_object(Bucket=self.bucket, Key=f"{self.prefix}/{name}")["Body"].read()

    def time(self, name):
        return self.client.head_object(Bucket=self.bucket, Key=f"{self.prefix}/{name}")["LastModified"].timestamp()


class Container:
    """Files of a place in a container of Azure's, asked for past the proxy."""

    def __init__(self, client, prefix):
        self.client, self.prefix = client, prefix

    def names(self, folder=""):
        prefix = f"{self.prefix}/{folder + '/' if folder else ''}"
        found = self.client.walk_blobs(name_starts_with=prefix, delimiter="/")
        return [item.name.rsplit("/", 1)[1] for item in found if not item.name.endswith("/")]

    def read(self, name):
        return self.client.download_blob(f"{self.prefix}/{name}").readall()

    def time(self, name):
        return self.client.get_blob_client(f"{self.prefix}/{name}").get_blob_properties().last_modified.timestamp()


def parts(store):
    """Names of parts, and of the files with the checksums of CSV and NPZ."""
    return sorted(name for name in store.names() if name.startswith("part-"))


def reports(store):
    return [name for name in store.names("workers") if len(name) == 37]


def share(program, out, store, alone, environments, rng, sweep=SWEEP, kills=1):
    """Three workers, one killed or more; tells what came of it."""
    begin = time.time()
    workers = [start(program, sweep, out, environment) for environment in environments]
    total = len(parts(alone))
    victims, killed_at = rng.sample(range(3), kills), []
    for wanted, victim in zip(sorted(rng.sample(range(1, total // 2), kills)), victims):
        # A worker that has not begun leaves nothing behind.
        while len(parts(store)) < wanted or len(reports(store)) < 3:
            if all(worker.poll() is not None for worker in workers):
                raise SystemExit("\n".join(worker.communicate()[0] or "" for worker in workers))
            time.sleep(0.02)
        workers[victim].send_signal(signal.SIGKILL)
        killed_at.append(len(parts(store)))
    for number, worker in enumerate(workers):
        text = worker.communicate(timeout=300)[0]
        if number not in victims and worker.returncode != 0:
            raise SystemExit(f"worker {number} ended with {worker.returncode}:\n{text}")
    check_same(store, alone)
    manifest = json.loads(store.read("manifest.json"))
    assert manifest["complete"] and sum(manifest["counts"].values()) == 30000, manifest
    assert sum(manifest["engines"].values()) == 30000, manifest["engines"]
    taken, mistaken = check_claims(store, manifest, {workers[victim].pid for victim in victims})
    seconds = time.time() - begin
    print(
        f"  {' and '.join(map(str, killed_at))} of {total} files at the kill, {taken} claims taken over, {mistaken} of living workers; "
        f"whole after {seconds:.1f} s",
        flush=True,
    )
    return mistaken


def check_same(store, alone):
    names = parts(alone)
    assert parts(store) == names, set(names) ^ set(parts(store))
    for name in names:
        assert store.read(name) == alone.read(name), f"{name} differs from that of a run alone"


def check_claims(store, manifest, dead):
    """How many claims of the dead workers have been taken over, none before it was silent for long enough; how many of
    living ones, which a machine under load may have kept silent for as long.
    """
    owner_of = {report["id"]: report["process"] for report in manifest["workers"]}
    claims, taken, mistaken = {}, 0, 0
    for name in store.names("claims"):
        unit, turn = name.split("-")
        claims.setdefault(unit, []).append((int(turn), store.read(f"claims/{name}").decode(), name))
    for unit, turns in claims.items():
        turns.sort()
        for (_, owner, _), (_, _, name) in zip(turns, turns[1:]):
            if owner_of[owner] not in dead:
                mistaken += 1
                continue
            # Times of a bucket are whole seconds.
            silent = store.time(f"claims/{name}") - store.time(f"workers/{owner}.json")
            assert silent >= SILENCE - 1, f"unit {unit} was taken over after {silent:.2f} s"
            taken += 1
    return taken, mistaken


def run_alone(program, folder, sweep=SWEEP):
    out = os.path.join(folder, os.path.basename(sweep) + "-alone")
    command = [program, "run", sweep, "--out", out, "--backend", "cpu", "--no-figures", "--quiet"] + PART
    # Parts name their engine with its threads.
    subprocess.run(command, check=True, env=dict(os.environ, RAYON_NUM_THREADS="1"))
    return Directory(out)


def directory(program, folder, rounds, rng):
    alone = run_alone(program, folder)
    for number in range(rounds):
        out = os.path.join(folder, f"shared-{number}")
        share(program, out, Directory(out), alone, [{}, {}, {}], rng)


def clocks(program, folder, rounds, rng):
    """Two of the workers have clocks that are an hour ahead and an hour behind."""
    library = glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1") + glob.glob("/usr/lib/*/faketime/libfaketime.so.1")
    if not library:
        print("  skipped: there is no libfaketime (Debian: apt install libfaketime)")
        return
    # The times of files stay those of the file system.
    honest = {"LD_PRELOAD": library[0], "NO_FAKE_STAT": "1", "DONT_FAKE_MONOTONIC": "1", "FAKETIME_DONT_FAKE_MONOTONIC": "1"}
    shifted = [dict(honest, FAKETIME=shift) for shift in ("+3600s", "-3600s")]
    told = subprocess.run(["date", "+%s"], env=dict(os.environ, **shifted[0]), capture_output=True, text=True).stdout
    assert abs(int(told) - time.time() - 3600) < 60, "the clock is not shifted"
    alone = run_alone(program, folder)
    for number in range(rounds):
        out = os.path.join(folder, f"shared-{number}")
        # Who compared clocks would take living workers for dead each time; load does so now and then.
        tries = (share(program, f"{out}-{k}", Directory(f"{out}-{k}"), alone, shifted + [{}], rng) for k in range(4))
        assert 0 in tries, "living workers are taken for dead"


def start_s3():
    """A real S3 interface with a bucket `runs`: its server, a client, host and port; `None`: this machine has none."""
    try:
        import boto3
        from moto.server import ThreadedMotoServer
    except ImportError:
        print("  skipped: there is no moto (pip install 'moto[server]')")
        return None
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    keys = {"AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_REGION": "us-east-1"}
    os.environ.update(keys)
    client = boto3.client("s3", endpoint_url=f"http://{host}:{port}", region_name="us-east-1")
    client.create_bucket(Bucket="runs")
    return server, client, host, port


def bucket(program, folder, rounds, rng):
    """Every twelfth reply is lost after the request was served."""
    started = start_s3()
    if started is None:
        return
    from proxy import LossyProxy

    server, client, host, port = started
    with LossyProxy(host, port, lost=1 / 12, seed=rng.randrange(1 << 30)) as proxy:
        environment = {"AWS_ENDPOINT_URL": f"http://127.0.0.1:{proxy.port}"}
        missing = status(program, "s3://nowhere/run", environment)
        assert missing.returncode == 1 and "there is no such bucket" in missing.stderr, missing
        alone = run_alone(program, folder)
        for number in range(rounds):
            store = Bucket(client, "runs", f"shared-{number}")
            share(program, f"s3://runs/shared-{number}", store, alone, [environment] * 3, rng)
        check_status(program, "s3://runs/shared-0", environment)
        check_profiles(program, folder, environment["AWS_ENDPOINT_URL"])
        print(f"  {proxy.requests} requests, {proxy.dropped} replies lost")
    with LossyProxy(host, port, lost=1 / 12, seed=rng.randrange(1 << 30), headers=as_of_s3) as proxy:
        key = {"disable_oauth": True, "client_email": "", "private_key": "", "private_key_id": ""}
        environment = {"GOOGLE_BASE_URL": f"http://127.0.0.1:{proxy.port}", "GOOGLE_SERVICE_ACCOUNT_KEY": json.dumps(key)}
        for number in range(rounds):
            store = Bucket(client, "runs", f"google-{number}")
            share(program, f"gs://runs/google-{number}", store, alone, [environment] * 3, rng)
        check_status(program, "gs://runs/google-0", environment)
        print(f"  {proxy.requests} requests as of Google's client, {proxy.dropped} replies lost")
    server.stop()


def formats(program, folder, rounds, rng):
    """Parts of every format in a bucket; two of three workers are killed, and every twelfth reply is lost."""
    started = start_s3()
    if started is None:
        return
    from proxy import LossyProxy

    server, client, host, port = started
    with open(SWEEP) as file:
        text = file.read().replace("../../sweeps", os.path.join(os.path.dirname(SWEEP), "../../sweeps"))
    for form in ["parquet", "csv", "npz"]:
        sweep = os.path.join(folder, f"{form}.toml")
        with open(sweep, "w") as file:
            file.write(f'{text}format = "{form}"\n')
        alone = run_alone(program, folder, sweep)
        with LossyProxy(host, port, lost=1 / 12, seed=rng.randrange(1 << 30)) as proxy:
            environment = {"AWS_ENDPOINT_URL": f"http://127.0.0.1:{proxy.port}"}
            for number in range(rounds):
                store = Bucket(client, "runs", f"{form}-{number}")
                share(program, f"s3://runs/{form}-{number}", store, alone, [environment] * 3, rng, sweep, kills=2)
            check_status(program, f"s3://runs/{form}-0", environment)
            print(f"  {form}: {2 * rounds} kills, {proxy.requests} requests, {proxy.dropped} replies lost", flush=True)
    server.stop()


def as_of_s3(headers):
    """Google's XML interface is that of S3 but for tokens and the header that asks for a place that is free."""
    signed = "AWS4-HMAC-SHA256 Credential=test/20260101/us-east-1/s3/aws4_request, SignedHeaders=host, Signature=0"
    of_s3 = {"authorization": signed}
    for name, value in headers:
        if name.lower() == "x-goog-if-generation-match":
            assert value == "0", value
            of_s3["If-None-Match"] = "*"
        elif name.lower() != "authorization":
            of_s3[name] = value
    return of_s3.items()


def check_profiles(program, folder, endpoint):
    """Keys, region and endpoint from ~/.aws."""
    aws = os.path.join(folder, ".aws")
    os.makedirs(aws, exist_ok=True)
    with open(os.path.join(aws, "credentials"), "w") as file:
        file.write("[lab]\naws_access_key_id = test\naws_secret_access_key = test\n")
    with open(os.path.join(aws, "config"), "w") as file:
        file.write(f"[profile lab]\nregion = us-east-1\nendpoint_url = {endpoint}\n[profile sso]\nsso_session = x\n")
    bare = {name: value for name, value in os.environ.items() if not name.startswith("AWS_")}
    for profile, expected in [("lab", "60 of 60 parts done"), ("other", 'no profile "other"'), ("sso", "export-credentials")]:
        environment = dict(bare, HOME=folder, AWS_PROFILE=profile)
        said = subprocess.run([program, "status", "s3://runs/shared-0"], env=environment, capture_output=True, text=True)
        assert expected in said.stdout + said.stderr, (profile, said)
        assert (said.returncode == 0) == (profile == "lab"), said


def status(program, place, environment):
    return subprocess.run([program, "status", place], env=dict(os.environ, **environment), capture_output=True, text=True)


def check_status(program, place, environment):
    said = status(program, place, environment)
    assert said.returncode == 0 and "60 of 60 parts done" in said.stdout, said


def container(program, folder, rounds, rng):
    """Azure's interface (Azurite); every twelfth reply is lost after the request was served."""
    azurite = os.environ.get("STORES_AZURITE", "")
    try:
        from azure.storage.blob import ContainerClient
    except ImportError:
        azurite = ""
    if not os.path.exists(azurite):
        print("  skipped: there is no Azurite (npm install azurite; pip install azure-storage-blob)")
        return
    from proxy import LossyProxy

    port = free_port()
    server = subprocess.Popen(
        [azurite, "--inMemoryPersistence", "--silent", "--skipApiVersionCheck", "--disableTelemetry", "--blobPort", str(port)],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_for(port)
        # The account that every emulator has.
        key = "Eby8vdM02xNOcqFlqUwJPLlmEtlCDXJ1OUzFT50uSRZ6IFsuFq2UVErCz4I6tq/K1SZFPTOtr/KBHBeksoGMGw=="
        client = ContainerClient(f"http://127.0.0.1:{port}/devstoreaccount1", "runs", credential=key)
        client.create_container()
        with LossyProxy("127.0.0.1", port, lost=1 / 12, seed=rng.randrange(1 << 30)) as proxy:
            environment = {
                "AZURE_STORAGE_USE_EMULATOR": "true",
                "AZURITE_BLOB_STORAGE_URL": f"http://127.0.0.1:{proxy.port}",
            }
            missing = status(program, "az://nowhere/run", environment)
            assert missing.returncode == 1 and "there is no such bucket" in missing.stderr, missing
            alone = run_alone(program, folder)
            for number in range(rounds):
                store = Container(client, f"shared-{number}")
                share(program, f"az://runs/shared-{number}", store, alone, [environment] * 3, rng)
            check_status(program, "az://runs/shared-0", environment)
            print(f"  {proxy.requests} requests, {proxy.dropped} replies lost")
    finally:
        server.terminate()
        server.wait()


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def wait_for(port):
    for _ in range(300):
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            return
        except OSError:
            time.sleep(0.1)
    raise SystemExit("the store did not start")


if __name__ == "__main__":
    part, program, folder, rounds = sys.argv[1:]
    sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
    os.makedirs(folder, exist_ok=True)
    seed = int(os.environ.get("SEED", time.time_ns() % 1_000_000))
    print(f"{part} (SEED={seed})", flush=True)
    kinds = {"directory": directory, "clocks": clocks, "bucket": bucket, "formats": formats, "container": container}
    kinds[part](os.path.abspath(program), os.path.abspath(folder), int(rounds), random.Random(seed))
