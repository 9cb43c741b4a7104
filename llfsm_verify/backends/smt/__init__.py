"""Step programs as terms of Z3."""

from llfsm_verify.backends.smt.contexts import tolerant_main

tolerant_main()
