% Which direction may go, and which must stop. The whiteboard gives the facts:
%   turn(D)       D has had the turn last
%   time_up       and has had it for long enough
%   light(D, C)   the lamps of D show C
%   car_waiting   the sensor sees a car in east-west

other(ns, ew).
other(ew, ns).

% Somebody always waits in north-south.
waits(ns).
waits(ew) :- car_waiting.

% A direction keeps the turn until its time is up and somebody waits in the other one.
passes(D) :- turn(D), time_up, other(D, O), waits(O).

next(D) :- turn(D), \+ passes(D).
next(D) :- other(D, O), passes(O).

may_go(D)    :- next(D), other(D, O), light(O, red).
must_stop(D) :- other(D, O), next(O).
