"""What the plugin imports late: a pytest run inside this process forgets the modules that it is the first to import."""

from llfsm_verify.report import replaying, text, updating
from llfsm_verify.testing.pytest_plugin import checks

PRELOADED = (checks, replaying, text, updating)
