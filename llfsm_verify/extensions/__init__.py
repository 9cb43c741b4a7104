"""Extensions: what only speaks to another program, such as a broker, a device, a log format or a terminal.

Each folder is one. Its `__init__.py` says in ENTRIES what it adds to which registry; the rest is imported when it is
asked for. An extension imports `llfsm_verify`, `llfsm_verify.testing` and `llfsm_verify.plug`, and nothing imports it.
"""
