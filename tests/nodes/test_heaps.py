"""What keeps the memory of a recorder where it is."""

import ctypes
import subprocess
import sys

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

# What threads free stays in the heaps that glibc's allocator has made for them. It tells of all
# heaps on standard output, in XML.
HEAPS = """
import ctypes, sys, threading

from ab_sim.nodes.process import share_heaps

met, libc = threading.Barrier(8), ctypes.CDLL(None)


def tell():
    libc.malloc_info(0, ctypes.c_void_p.in_dll(libc, "stdout"))
    libc.fflush(None)


def allocate():
    kept = [bytes(1000 + i) for i in range(1000)]
    met.wait()


if sys.argv[1] == "shared":
    share_heaps()
tell()
threads = [threading.Thread(target=allocate) for _ in range(8)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
tell()
"""


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallopt"), reason="the C library is not glibc")
def test_threads_make_no_further_heaps_where_told_so() -> None:
    further = {}
    for kind in ("shared", "own"):
        command = [sys.executable, "-c", HEAPS, kind]
        told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        _, before, after = told.split("<malloc ")
        further[kind] = after.count("<heap nr=") - before.count("<heap nr=")
    assert further["shared"] == 0
    assert further["own"] > 0
