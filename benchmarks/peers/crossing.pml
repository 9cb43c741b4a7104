/* A train, a level crossing and the radio between them, with failures; models/crossing.yaml is the same for us.
   Distances in metres, speeds in metres a cycle. Once brakes or the gate's motor have failed, they stay so. */
mtype:comm = { IDLE, ACTIVE, SIGNAL };
mtype:gate = { OPENED, CLOSING, CLOSED };
mtype:train = { RUN, WAIT, QUERY, STOP, GO };
mtype:comm query = IDLE, close = IDLE, secured = IDLE, t_closing = IDLE, t_open = IDLE;
mtype:gate gate = OPENED;
mtype:train train = RUN;
byte k_query, k_close, k_secured, k_closing, k_open;
bool brakes, f_brakes, f_stuck, f_secured, f_close, f_open, f_comm;
short odometer, pos, speed = 29;
hidden short vs, stop_at, query_at, close_at;

inline may(f) { if :: f = 0 :: f = 1 fi }
inline breaks(f) { if :: skip :: f = 1 fi }
inline timer(t, k, start) {
  if
  :: t == IDLE -> if :: start -> k = 30; t = ACTIVE :: else fi
  :: t == ACTIVE -> if :: k > 0 -> k-- :: else -> t = SIGNAL fi
  :: t == SIGNAL -> t = IDLE
  fi
}
inline world() {
  breaks(f_brakes); breaks(f_stuck);
  if :: odometer = 0 :: odometer = -1 :: odometer = -2 :: odometer = -3 fi;
  may(f_secured); may(f_close); may(f_open); may(f_comm);
  speed = (brakes && speed > 0 -> speed - 1 : speed);
  pos = (pos + speed < 3333 -> pos + speed : 3333)
}
inline control() {
  vs = (speed + odometer > 0 -> speed + odometer : 0);
  stop_at = 3000 - vs * vs / 2 - 116;
  query_at = stop_at - 2 * vs - 116;
  close_at = query_at - 31 * vs - 116;
  timer(query, k_query, train == WAIT && pos >= query_at && !f_comm);
  timer(close, k_close, train == RUN && pos >= close_at && !f_comm);
  timer(secured, k_secured, query == SIGNAL && !f_comm && (gate == CLOSED || f_secured));
  if
  :: train == RUN && pos >= close_at -> train = WAIT
  :: train == WAIT && pos >= query_at -> train = QUERY
  :: train == QUERY && secured == ACTIVE -> train = GO
  :: train == QUERY && secured != ACTIVE && pos >= stop_at -> train = STOP
  :: else
  fi;
  if
  :: train == STOP && !f_brakes -> brakes = 1
  :: !(train == STOP && !f_brakes) && brakes && f_brakes -> brakes = 0
  :: else
  fi;
  if
  :: gate == OPENED && close == SIGNAL && !f_close -> gate = CLOSING
  :: gate == CLOSING && t_closing == SIGNAL && !f_stuck -> gate = CLOSED
  :: gate == CLOSED && (t_open == SIGNAL || pos >= 3100 || f_open) -> gate = OPENED
  :: else
  fi;
  timer(t_closing, k_closing, gate == OPENED && close == SIGNAL);
  timer(t_open, k_open, gate == CLOSED)
}
active proctype crossing() { do :: atomic { world(); control() } od }

ltl safe { [] !(pos <= 3000 && 3000 < pos + speed && gate != CLOSED) }
