"""What the plugin imports late: a pytest run inside this process forgets the modules that it is the first to import."""

from llfsm_verify.extensions.pytest_plugin import checks
from llfsm_verify.report import saving, text
from llfsm_verify.verification import replay as trace_replay

PRELOADED = (checks, trace_replay, text, saving)
