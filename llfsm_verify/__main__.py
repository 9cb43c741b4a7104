"""`python -m llfsm_verify` is `llfsm`."""

from llfsm_verify.cli import main

raise SystemExit(main())
