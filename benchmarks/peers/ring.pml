/* LLFSM-like ring.  N machines, deterministic round robin; machine m has states OFF/ON, a counter 0..C-1 and an input of
   its own.  One d_step is one ringlet, with its input chosen before it: SPIN stores one state a ringlet, as we do.
   (With the input chosen by an `if` between two d_steps SPIN stores four, and takes four times as long.) */
#ifndef N
#define N 4
#endif
#ifndef C
#define C 3
#endif
byte turn = 0;
bit st[N]; byte cnt[N]; bit fresh[N];
hidden byte prev;
#define RINGLET(inp) d_step { \
  prev = (turn + N - 1) % N; \
  if :: fresh[turn] -> fresh[turn] = 0; if :: st[turn] -> cnt[turn] = (cnt[turn] + 1) % C :: else -> skip fi \
     :: else -> skip fi; \
  if :: (!st[turn] && inp && (!st[prev] || N==1)) -> st[turn] = 1; fresh[turn] = 1 \
     :: (st[turn] && (!inp || st[prev])) -> st[turn] = 0; fresh[turn] = 1 \
     :: else -> skip fi; \
  turn = (turn + 1) % N; prev = 0 }
active proctype sched() { do :: RINGLET(0) :: RINGLET(1) od }
#ifdef LTL
ltl never_off { [] (st[0]==0 -> <> (st[0]!=0)) }
ltl apart { [] (st[0]!=0 -> <> (st[0]==0 || st[N-1]==0)) }
#if N > 2
ltl not_three { [] !(st[0]==1 && st[1]==1 && st[2]==1) }
#endif
#endif
