; Steps: one, every one from given records, and whose is next. `kernel.py` has the numbers for the words in angle brackets.
declare void @llvm.memcpy.p0.p0.i64(ptr noalias, ptr noalias, i64, i1)
; One step of process %p (their number: the stutter).
define i32 @step(ptr noalias %r, ptr noalias %c, i64 %p) #1 {
  %step.p = getelementptr i64, ptr %c, i64 <C.STEP>
  %step = load i64, ptr %step.p
  %next = add i64 %step, 1
  store i64 %next, ptr %step.p
  %samples.p = getelementptr i64, ptr %c, i64 <C.SAMPLES>
  store i64 0, ptr %samples.p
  %events.p = getelementptr i64, ptr %c, i64 <C.EVENTS>
  store i64 0, ptr %events.p
  %status = call i32 @ringlet(ptr %r, ptr %c, i64 %p)
  ret i32 %status
}
; The next combination of the choices that the last step read, as an odometer whose last wheel is the choice read
; last; false when there is none.
define internal i1 @advance(ptr %c) #1 {
entry:
  %n.p = getelementptr i64, ptr %c, i64 <C.SAMPLES>
  %prefix.p = getelementptr i64, ptr %c, i64 <C.PREFIX>
  %n = load i64, ptr %n.p
  br label %look
look:
  %i = phi i64 [%n, %entry], [%j, %wheel]
  %none = icmp eq i64 %i, 0
  br i1 %none, label %exhausted, label %wheel
wheel:
  %j = sub i64 %i, 1
  %twice = shl i64 %j, 1
  %pair.i = add i64 %twice, <SAMPLES>
  %pair.p = getelementptr i64, ptr %c, i64 %pair.i
  %pair.v = getelementptr i64, ptr %pair.p, i64 1
  %choice = load i64, ptr %pair.p
  %value = load i64, ptr %pair.v
  %high.p = getelementptr i64, ptr @highs, i64 %choice
  %high = load i64, ptr %high.p
  %room = icmp ne i64 %value, %high
  br i1 %room, label %turn, label %look
turn:
  %more = add i64 %value, 1
  store i64 %more, ptr %pair.v
  store i64 %i, ptr %prefix.p
  ret i1 true
exhausted:
  store i64 0, ptr %prefix.p
  ret i1 false
}
; An edge for every step from the records, from where the context says until the buffer is full; returns the number of
; edges written. All is done when the context's SOURCE reaches the number of records.
define i64 @expand(ptr noalias %records, i64 %count, ptr noalias %buffer, i64 %capacity, ptr noalias %c) #1 {
entry:
  %n.v = alloca i64
  store i64 0, ptr %n.v
  %source.p = getelementptr i64, ptr %c, i64 <C.SOURCE>
  %process.p = getelementptr i64, ptr %c, i64 <C.PROCESS>
  %stepped.p = getelementptr i64, ptr %c, i64 <C.STEPPED>
  %samples.p = getelementptr i64, ptr %c, i64 <C.SAMPLES>
  %status.p = getelementptr i64, ptr %c, i64 <C.STATUS>
  %table.p = getelementptr i64, ptr %c, i64 <SAMPLES>
  br label %again
again:
  %n = load i64, ptr %n.v
  %source = load i64, ptr %source.p
  %full = icmp uge i64 %n, %capacity
  %over = icmp uge i64 %source, %count
  %stop = or i1 %full, %over
  br i1 %stop, label %out, label %find
find:
  %p = load i64, ptr %process.p
  %at = mul i64 %source, <RECORD>
  %in = getelementptr i8, ptr %records, i64 %at
  %last = icmp uge i64 %p, <PROCESSES>
  br i1 %last, label %ended, label %candidate
candidate:
  %on = call i1 @enabled(ptr %in, i64 %p)
  br i1 %on, label %go, label %skip
skip:
  %p.skip = add i64 %p, 1
  store i64 %p.skip, ptr %process.p
  br label %again
ended:
  %stepped = load i64, ptr %stepped.p
  %live = icmp ne i64 %stepped, 0
  br i1 %live, label %following, label %go
following:
  %source.next = add i64 %source, 1
  store i64 %source.next, ptr %source.p
  store i64 0, ptr %process.p
  store i64 0, ptr %stepped.p
  br label %again
go:
  %edge.i = mul i64 %n, <EDGE>
  %edge = getelementptr i8, ptr %buffer, i64 %edge.i
  %body = getelementptr i8, ptr %edge, i64 <BODY>
  call void @llvm.memcpy.p0.p0.i64(ptr %body, ptr %in, i64 <RECORD>, i1 false)
  %status = call i32 @step(ptr %body, ptr %c, i64 %p)
  %source.32 = trunc i64 %source to i32
  store i32 %source.32, ptr %edge
  %p.32 = trunc i64 %p to i32
  %shown = select i1 %last, i32 -1, i32 %p.32
  %edge.process = getelementptr i8, ptr %edge, i64 4
  store i32 %shown, ptr %edge.process
  %edge.status = getelementptr i8, ptr %edge, i64 8
  store i32 %status, ptr %edge.status
  %samples = load i64, ptr %samples.p
  %samples.32 = trunc i64 %samples to i32
  %edge.samples = getelementptr i8, ptr %edge, i64 12
  store i32 %samples.32, ptr %edge.samples
  %tail = getelementptr i8, ptr %edge, i64 <TAIL>
  %samples.bytes = shl i64 %samples, 4
  call void @llvm.memcpy.p0.p0.i64(ptr %tail, ptr %table.p, i64 %samples.bytes, i1 false)
  %n.next = add i64 %n, 1
  store i64 %n.next, ptr %n.v
  %bad = icmp eq i32 %status, <BROKEN>
  br i1 %bad, label %broken, label %advance
broken:
  store i64 <BROKEN>, ptr %status.p
  br label %advance
advance:
  %more = call i1 @advance(ptr %c)
  br i1 %more, label %again, label %exhausted
exhausted:
  br i1 %last, label %following, label %more.processes
more.processes:
  store i64 1, ptr %stepped.p
  %p.next = add i64 %p, 1
  store i64 %p.next, ptr %process.p
  br label %again
out:
  ret i64 %n
}
; The process that steps next in a run (their number: none is left).
define internal i64 @pick(ptr noalias %r, ptr noalias %c) #1 {
entry:
  %process.p = getelementptr i64, ptr %c, i64 <C.PROCESS>
  %turn = load i64, ptr %process.p
  %seed = load i64, ptr %c
  %fixed = icmp eq i64 %seed, 0
  br i1 %fixed, label %robin, label %count
robin:
  %k = phi i64 [0, %entry], [%k.next, %robin.next]
  %none = icmp uge i64 %k, <PROCESSES>
  br i1 %none, label %nobody, label %try
try:
  %sum = add i64 %turn, %k
  %p = urem i64 %sum, <PROCESSES>
  %on = call i1 @enabled(ptr %r, i64 %p)
  br i1 %on, label %found, label %robin.next
robin.next:
  %k.next = add i64 %k, 1
  br label %robin
found:
  ret i64 %p
count:
  %i = phi i64 [0, %entry], [%i.next, %count.next]
  %live = phi i64 [0, %entry], [%live.next, %count.next]
  %counted = icmp uge i64 %i, <PROCESSES>
  br i1 %counted, label %draw, label %count.next
count.next:
  %i.on = call i1 @enabled(ptr %r, i64 %i)
  %one = zext i1 %i.on to i64
  %live.next = add i64 %live, %one
  %i.next = add i64 %i, 1
  br label %count
draw:
  %empty = icmp eq i64 %live, 0
  br i1 %empty, label %nobody, label %choose
choose:
  %wanted = call i64 @random(ptr %c, i64 %live)
  br label %seek
seek:
  %j = phi i64 [0, %choose], [%j.next, %seek.next]
  %left = phi i64 [%wanted, %choose], [%left.next, %seek.next]
  %j.on = call i1 @enabled(ptr %r, i64 %j)
  %zero = icmp eq i64 %left, 0
  %here = and i1 %zero, %j.on
  br i1 %here, label %chosen, label %seek.next
seek.next:
  %less = zext i1 %j.on to i64
  %left.next = sub i64 %left, %less
  %j.next = add i64 %j, 1
  br label %seek
chosen:
  ret i64 %j
nobody:
  ret i64 <PROCESSES>
}
