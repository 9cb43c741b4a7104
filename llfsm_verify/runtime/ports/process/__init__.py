"""Ports that are programs: a child of the supervisor, which speaks lines of JSON (decision 70).

The child reads its standard input and writes its standard output, both of which are one end of a pair of sockets; its
standard error is that of the run. Each line is an object with one of these keys first (fields: names of the file of
ports; `values`: by field, nested where a field has dots):

    run to child
      {"hello": 1, "port": NAME, "cycle_ms": C, "inputs": {FIELD: TYPE}, "outputs": {FIELD: TYPE},
       "requests": {NAME: REQUEST}, "told": {…}}                          the first line; `told`: by the kind of port
                                                                         (with `clock: external` also "cycle": N, the
                                                                         number of the cycle that begins next, from 0)
      {"values": {…}, "time": T, "cycle": N}                             outputs have changed, or with `clock: external`
                                                                         cycle N has ended; T: monotonic seconds
      {"request": 17, "name": NAME, "values": {…}}                       to be answered by its number
      {"cancel": 17}                                                     its answer is not wanted any more, as where
                                                                         the run ends; an action still reports its end
      {"safe": {…}}                                                      the run has ended, and these are safe values
      {"end": "stopped"}                                                 the last line; then the socket is closed
    child to run
      {"hello": 1, "values": {…}}                                        within PATIENCE; values of inputs before the
                                                                         first cycle, also of those that never change
      {"values": {…}}                                                    inputs
      {"state": "ACTIVE", "of": 17, "values": {…}}                       an action has this state now; feedback
      {"answer": 17, "state": "DONE", "values": {…}}                     the end of a request; DONE or FAILED, or the
                                                                         end of an action; without `state` DONE
      {"lost": ["FIELD", …], "why": TEXT}                                these inputs have failed; all, without names
      {"say": TEXT}                                                      is shown to the user, once for each text;
                                                                         instead of hello: why it cannot begin
      {"cycle": N, "values": {…}}                                        with `clock: external`: cycle N begins now, and
                                                                         reads these values

TYPE is {"low": L, "high": H, "boolean": B, "digits": D, "labels": [NAME, …]}: a truth value, a number with D decimals
from L to H times 10^-D, or one of the names. REQUEST is {"kind": "service" or "action", "timeout": SECONDS or null,
"sends": {FIELD: TYPE}, "answers": {FIELD: TYPE}, "feedback": {FIELD: TYPE}} and what its kind of port has of it, such
as "service": "/locate". Numbers of requests are never used again, also not by a child that was started again.

A child that ends, or says what is no message in its first line, has failed with all its inputs; its requests under way
become FAILED or LOST, and it is started again, RESTART seconds later, then twice as long, up to LONGEST_RESTART.
"""
