"""Grading on Dask: a real scheduler and two worker processes on loopback, with certificates made here."""

from __future__ import annotations

import contextlib
import datetime
import ipaddress
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from distributed import Client, Security
from grading_helpers import ROOT, alive_after, job, need_sandbox, submission
from how_thorough import sample

from course_lib.authoring.tree import CourseError
from course_lib.grading.records import same_grades
from course_lib.grading.run import pool
from course_lib.grading.run.cluster import grade_on_cluster

ANSWERS = ["return depth_mm / 1000", "return depth_mm", "return depth_mm * 1000", "raise ValueError('no')"]


COUNT = sample(12, 6)


def jobs() -> list[dict]:
    return [
        job("00", submission("00", {1: f"def metres(depth_mm):\n    # number {i}\n    {ANSWERS[i % 4]}\n"}))
        for i in range(COUNT)
    ]


@pytest.fixture(scope="module")
def certificates(tmp_path_factory) -> dict[str, str]:
    """A key and a certificate that signs itself, for 127.0.0.1, for one day."""
    folder = tmp_path_factory.mktemp("tls")
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "127.0.0.1")])
    now = datetime.datetime.now(datetime.UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(hours=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .add_extension(x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]), critical=False)
        .sign(key, hashes.SHA256())
    )
    (folder / "cert.pem").write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    plain = serialization.NoEncryption()
    (folder / "key.pem").write_bytes(
        key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, plain)
    )
    return {"cert": str(folder / "cert.pem"), "key": str(folder / "key.pem")}


def _address(told: Path, scheduler: subprocess.Popen) -> str:
    """Where a scheduler listens, as soon as it says so: on a port that it chose, which nobody can have taken before."""
    end = time.monotonic() + 60
    while time.monotonic() < end and scheduler.poll() is None:
        with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):  # not written yet, or half
            return json.loads(told.read_text(encoding="utf-8"))["address"]
        time.sleep(0.05)
    pytest.fail(f"the scheduler did not start: {(told.parent / '0.log').read_text(errors='replace')[-800:]}")


@pytest.fixture(scope="module")
def cluster(certificates, tmp_path_factory):
    """The address of a scheduler with two workers, its security, and its processes; the last test kills one worker."""
    need_sandbox()
    tmp_path = tmp_path_factory.mktemp("cluster")
    tls = ["--tls-ca-file", certificates["cert"], "--tls-cert", certificates["cert"], "--tls-key", certificates["key"]]
    processes = []

    def start(*words: str) -> None:
        command = [sys.executable, "-P", "-m", f"distributed.cli.{words[0]}", *words[1:], "--no-dashboard", *tls]
        with open(tmp_path / f"{len(processes)}.log", "wb") as log:
            environment = {**os.environ, "PYTHONPATH": str(ROOT)}
            processes.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log, cwd=tmp_path))

    try:
        told = tmp_path / "scheduler.json"
        start("dask_scheduler", "--host", "tls://127.0.0.1:0", "--no-show", "--scheduler-file", str(told))
        address = _address(told, processes[0])
        for _ in range(2):
            worker = ["--nthreads", "1", "--no-nanny", "--death-timeout", "60", "--host", "127.0.0.1"]
            start("dask_worker", address, *worker, "--local-directory", str(tmp_path))
        security = Security(
            tls_ca_file=certificates["cert"],
            tls_client_cert=certificates["cert"],
            tls_client_key=certificates["key"],
            require_encryption=True,
        )
        with Client(address, security=security, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
        yield address, security, processes[1:]
    finally:
        family = [
            child for p in processes if p.poll() is None for child in psutil.Process(p.pid).children(recursive=True)
        ]
        for process in processes:
            process.kill()
            process.wait(10)
        alive = alive_after(family)
        for process in alive:
            process.kill()
        assert not alive, [process.cmdline() for process in alive]


@pytest.fixture(scope="module")
def expected() -> dict:
    need_sandbox()
    records: dict = {}
    pool.grade_jobs(jobs(), 2, records.__setitem__)
    return records


def collected(address, security, after_each=lambda place: None) -> dict:
    records: dict = {}

    def keep(place, record):
        assert place not in records, "a record came twice"
        records[place] = record
        after_each(place)

    grade_on_cluster(address, jobs(), keep, security)
    return records


@pytest.mark.slow
def test_the_cluster_gives_the_same_grades(cluster, expected):
    address, security, _ = cluster
    records = collected(address, security)
    assert sorted(records) == sorted(expected) == list(range(COUNT))
    assert all(same_grades(records[place], expected[place]) for place in expected)


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_loses_nothing(cluster, expected):
    address, security, workers = cluster
    seen = []

    def kill(place):
        seen.append(place)
        if len(seen) == 3:
            workers[0].send_signal(signal.SIGKILL)
            workers[0].wait(10)

    records = collected(address, security, kill)
    assert workers[0].poll() is not None and sorted(records) == list(range(COUNT))
    assert all(same_grades(records[place], expected[place]) for place in expected)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:8786", "127.0.0.1:8786", "ws://127.0.0.1"])
def test_an_open_address_is_refused(address):
    with pytest.raises(CourseError, match="open to everybody"):
        grade_on_cluster(address, jobs(), print)


def test_nobody_answers(certificates, monkeypatch):
    monkeypatch.setattr("course_lib.grading.run.cluster.SECONDS_TO_CONNECT", 0.2)
    security = Security(
        tls_ca_file=certificates["cert"], tls_client_cert=certificates["cert"], tls_client_key=certificates["key"]
    )
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(CourseError, match="no Dask scheduler answers"):
        grade_on_cluster(f"tls://127.0.0.1:{port}", jobs(), print, security)
