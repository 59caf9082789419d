"""Chunks on a Dask cluster: workers compute and send back, here it is written. Needs the extra `cluster`.

A Dask scheduler without TLS runs whatever anyone who reaches its port sends it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from robocal._record import record
from robocal.errors import FileError
from robocal.files.writing import write_bytes
from robocal.studies.work import Work, compute

__all__ = ["Cluster", "on_cluster"]

PATIENCE = 20.0  # s until a scheduler answers


@record
class Cluster:
    """Where the scheduler is, tcp://host:port or tls://host:port, and the files of TLS: of the authority, of our certificate and of
    its key."""

    address: str
    ca: str | None = None
    cert: str | None = None
    key: str | None = None


def on_cluster(left: Sequence[Work], cluster: Cluster) -> Iterator[int]:
    """The numbers of trials of chunks as they get done. What a worker that dies was at is done by another. Raises FileError where no
    scheduler answers, and whatever the trials raised."""
    try:
        from distributed import Client, as_completed
        from distributed.security import Security
    except ImportError:
        needs, expected = "a cluster needs the extra `cluster`", "pip install robocal[cluster]"
        raise FileError(needs, file=cluster.address, expected=expected) from None
    words = {"tls_ca_file": cluster.ca, "tls_client_cert": cluster.cert, "tls_client_key": cluster.key}
    told: dict[str, Any] = {k: v for k, v in words.items() if v is not None}
    try:
        security = Security(**told) if told else None
        client = Client(cluster.address, timeout=PATIENCE, security=security, set_as_default=False)
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        expected = "tcp://HOST:PORT, or tls://"
        raise FileError(f"no scheduler answers: {error}", file=cluster.address, expected=expected) from None
    try:
        futures = {client.submit(compute, work, pure=False): work for work in left}
        for future in as_completed(list(futures), loop=client.loop):
            work = futures.pop(future)
            write_bytes(work.place, future.result())
            future.release()
            yield work.count
    finally:
        client.close()
