"""The search kernels: loops over memory that numba makes into LLVM text (`kripke.texts`), which is compiled once per
installation (`kripke.compiled`).

Importing anything but `entries` and `blocks` from here imports numba. A kernel is a function from the address of its
control block to a code that says why it returned (`blocks`); it returns after a bounded portion of work, so that Ctrl-C
and limits are served. All numbers are signed 64-bit integers (numba would make a float of a mix of signed and
unsigned), all memory is given by address and belongs to `kripke.memory`.
"""
