"""Start a program from a small process: the kernel counts the starter's memory as the started program's largest.

`python -I -S launch.py FD PROGRAM ARGUMENTS…` writes "wall cpu peak status" to the file descriptor: seconds, seconds,
KiB and the wait status.
"""

import os
import sys
import time

begin = time.perf_counter()
child = os.posix_spawnp(sys.argv[2], sys.argv[2:], os.environ)
_, status, usage = os.wait4(child, 0)
wall = time.perf_counter() - begin
line = f"{wall} {usage.ru_utime + usage.ru_stime} {usage.ru_maxrss} {status}"
os.write(int(sys.argv[1]), line.encode())
