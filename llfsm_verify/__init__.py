"""A model checker for arrangements of logic-labelled finite-state machines.

This file has no assertions for pytest to rewrite (PYTEST_DONT_REWRITE): else pytest, which loads our plugin, would warn
where a program imports us before it runs pytest.
"""
