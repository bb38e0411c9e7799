"""Worker processes that end with whoever started them. No NumPy here: thread counts are set before it is imported."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context

from planner.errors import PlannerError

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@contextmanager
def worker_pool(workers: int, killed: type[PlannerError]) -> Iterator[ProcessPoolExecutor]:
    """A pool of processes of one thread each; on an error inside, those that work are ended, not waited for.

    Args:
        workers: how many.
        killed: what to raise if one of them is killed.
    """
    # Spawned, not forked: a fork of a process with threads can hang.
    others = set(active_children())
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=start_worker)
    try:
        yield pool
    except BrokenProcessPool:
        raise killed(
            "a worker process was killed (out of memory?); finished runs are kept: run the same again, perhaps "
            "with fewer processes"
        ) from None
    except BaseException:  # e.g. a second Ctrl-C
        for worker in set(active_children()) - others:
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def start_worker() -> None:
    """One thread each, unless the user said otherwise: there are as many processes as wanted already.

    Ctrl-C goes to the whole process group, but it is their parent that decides what becomes of runs under way. A
    parent that is killed takes its workers along, which would else wait for work for ever.
    """
    for name in THREADS:
        os.environ.setdefault(name, "1")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)
