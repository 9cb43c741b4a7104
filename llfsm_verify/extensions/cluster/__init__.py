"""Sweeps on the workers of a Dask scheduler, which need no shared disk.

What a user starts, on any machines, and writes:

    $ dask scheduler --port 8786
    $ dask worker tcp://HOST:8786 --nthreads 1
    $ llfsm sweep SWEEP.yaml --scheduler tcp://HOST:8786

A worker that dies costs nothing: Dask performs its task elsewhere. A process performs one task at a time, so a worker
has one thread.

Mistakes:

    error[E604]: `tcp://HOST` is not the address of a scheduler
      hint: write it as `tcp://HOST:8786`
    error[E600]: no scheduler answers at tcp://HOST:8786: Timed out trying to connect to tcp://HOST:8786 after 10 s
    error[E602]: the worker tcp://10.0.0.7:4000 has llfsm-verify 0.0.9, and here is 0.1.0
"""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

DASK = Package("distributed", "distributed", "cluster")
ENTRIES = {
    "llfsm_verify.codes": (Entry("cluster", f"{__name__}.codes:CODES", "Sweeps on clusters"),),
    "llfsm_verify.schedulers": (
        Entry("tcp", f"{__name__}.dask:Cluster", "a scheduler of Dask", package=DASK),
        Entry("tls", f"{__name__}.dask:Cluster", "the same, over TLS", package=DASK),
    ),
}
