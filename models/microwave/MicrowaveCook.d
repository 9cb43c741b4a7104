% MicrowaveCook.d

name {MicrowaveCook}.

input {timeLeft}.
input {doorOpen}.

C0: {} => ~cook.
C1: timeLeft => cook. C1 > C0.
C2: doorOpen => ~cook. C2 > C1.

output {b cook, "cook"}.
