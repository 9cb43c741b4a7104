; The loop that runs an arrangement. `text.py` has the numbers for the words in angle brackets.
declare i32 @clock_gettime(i32, ptr)
declare i32 @clock_nanosleep(i32, i32, ptr, ptr)
declare i64 @sendto(i32, ptr, i64, i32, ptr, i32)
define internal i64 @now() #1 {
  %time = alloca [2 x i64]
  %status = call i32 @clock_gettime(i32 <CLOCK_MONOTONIC>, ptr %time)
  %seconds = load i64, ptr %time
  %rest.p = getelementptr i64, ptr %time, i64 1
  %rest = load i64, ptr %rest.p
  %whole = mul i64 %seconds, 1000000000
  %sum = add i64 %whole, %rest
  ret i64 %sum
}
; Appends a number to the recording, seven bits a byte, the lowest first.
define internal void @varint(ptr %t, i64 %number) #1 {
entry:
  %cursor.p = getelementptr i64, ptr %t, i64 <CURSOR>
  %begin = load ptr, ptr %cursor.p
  br label %loop
loop:
  %at = phi ptr [%begin, %entry], [%next, %more]
  %v = phi i64 [%number, %entry], [%rest, %more]
  %next = getelementptr i8, ptr %at, i64 1
  %low = trunc i64 %v to i8
  %small = icmp ult i64 %v, 128
  br i1 %small, label %last, label %more
more:
  %marked = or i8 %low, -128
  store i8 %marked, ptr %at
  %rest = lshr i64 %v, 7
  br label %loop
last:
  store i8 %low, ptr %at
  store ptr %next, ptr %cursor.p
  ret void
}
; The same for one with a sign: 0, -1, 1, -2, … are 0, 1, 2, 3, …
define internal void @signed(ptr %t, i64 %number) #1 {
  %twice = shl i64 %number, 1
  %sign = ashr i64 %number, 63
  %folded = xor i64 %twice, %sign
  call void @varint(ptr %t, i64 %folded)
  ret void
}
; Of the entry of %size bytes at %begin, where the one before it has %before: words of 8 bytes, the last one filled up
; with zeros (they are written after the entry), are mixed into a state by xor, multiplication and shift, as at the
; end of MurmurHash3 (A. Appleby, 2011). `recording.file.checksum` is the same in Python.
define internal i32 @checksum(ptr %begin, i64 %size, i32 %before) #1 {
entry:
  %end = getelementptr i8, ptr %begin, i64 %size
  store i64 0, ptr %end, align 1
  %length = shl i64 %size, 32
  %low = zext i32 %before to i64
  %first = or i64 %length, %low
  br label %loop
loop:
  %at = phi i64 [0, %entry], [%at.next, %loop]
  %state = phi i64 [%first, %entry], [%state.next, %loop]
  %word.p = getelementptr i8, ptr %begin, i64 %at
  %word = load i64, ptr %word.p, align 1
  %mixed = xor i64 %state, %word
  %product = mul i64 %mixed, <MULTIPLIER>
  %high = lshr i64 %product, 32
  %state.next = xor i64 %product, %high
  %at.next = add i64 %at, 8
  %over = icmp uge i64 %at.next, %size
  br i1 %over, label %out, label %loop
out:
  %check = trunc i64 %state.next to i32
  ret i32 %check
}
; Before ringlet %k of this turn, choices get the values that are prescribed for this step; those that come after the
; first ringlet are recorded.
define internal void @script(ptr %c, ptr %t, i64 %k) #1 {
entry:
  %image.p = getelementptr i64, ptr %t, i64 <IMAGE>
  %image = load ptr, ptr %image.p
  %steps.p = getelementptr i64, ptr %image, i64 <H.STEPS>
  %steps = load i64, ptr %steps.p
  %script.p = getelementptr i64, ptr %t, i64 <SCRIPT>
  %left.p = getelementptr i64, ptr %t, i64 <SCRIPT_LEFT>
  %log.p = getelementptr i64, ptr %t, i64 <LOG>
  %log = load ptr, ptr %log.p
  %recorded = icmp ne ptr %log, null
  %within = icmp ne i64 %k, 0
  %noted = and i1 %recorded, %within
  br label %loop
loop:
  %left = load i64, ptr %left.p
  %none = icmp eq i64 %left, 0
  br i1 %none, label %out, label %look
look:
  %line = load ptr, ptr %script.p
  %step = load i64, ptr %line
  %later = icmp ugt i64 %step, %steps
  br i1 %later, label %out, label %put
put:
  %choice.p = getelementptr i64, ptr %line, i64 1
  %choice = load i64, ptr %choice.p
  %value.p = getelementptr i64, ptr %line, i64 2
  %value = load i64, ptr %value.p
  %place.i = add i64 %choice, <DEFAULTS>
  %place = getelementptr i64, ptr %c, i64 %place.i
  store i64 %value, ptr %place
  %line.next = getelementptr i64, ptr %line, i64 3
  store ptr %line.next, ptr %script.p
  %left.next = sub i64 %left, 1
  store i64 %left.next, ptr %left.p
  br i1 %noted, label %note, label %loop
note:
  %number = add i64 %choice, 1
  call void @varint(ptr %t, i64 %number)
  call void @varint(ptr %t, i64 %k)
  call void @signed(ptr %t, i64 %value)
  br label %loop
out:
  ret void
}
define internal void @sources(ptr %c, ptr %t) #1 {
entry:
  %writers.p = getelementptr i64, ptr %t, i64 <WRITERS>
  %writers = load ptr, ptr %writers.p
  %count.p = getelementptr i64, ptr %t, i64 <WRITER_COUNT>
  %count = load i64, ptr %count.p
  %sources.p = getelementptr i64, ptr %t, i64 <SOURCES>
  %sources = load ptr, ptr %sources.p
  %all.p = getelementptr i64, ptr %t, i64 <SOURCE_COUNT>
  %all = load i64, ptr %all.p
  %refused.p = getelementptr i64, ptr %t, i64 <REFUSED>
  br label %writer
writer:
  %i = phi i64 [0, %entry], [%i.next, %read], [%i.next, %fresh], [%i.next, %keep]
  %over = icmp uge i64 %i, %count
  br i1 %over, label %source, label %read
read:
  %row.i = mul i64 %i, 5
  %row = getelementptr i64, ptr %writers, i64 %row.i
  %i.next = add i64 %i, 1
  %segment = load ptr, ptr %row
  %copy.p = getelementptr i64, ptr %row, i64 1
  %copy = load ptr, ptr %copy.p
  %words.p = getelementptr i64, ptr %row, i64 2
  %words = load i64, ptr %words.p
  %newest.p = getelementptr i64, ptr %segment, i64 <NEWEST>
  %newest = load atomic i64, ptr %newest.p acquire, align 8
  %read.p = getelementptr i64, ptr %row, i64 3
  %last = load i64, ptr %read.p
  %same = icmp eq i64 %newest, %last
  br i1 %same, label %writer, label %fresh
fresh:
  %scratch.p = getelementptr i64, ptr %row, i64 4
  %scratch = load ptr, ptr %scratch.p
  %whole = call i1 @frame(ptr %segment, ptr %scratch, i64 %words, i64 %newest)
  br i1 %whole, label %keep, label %writer
keep:
  %size = shl i64 %words, 3
  call void @llvm.memcpy.p0.p0.i64(ptr %copy, ptr %scratch, i64 %size, i1 false)
  store i64 %newest, ptr %read.p
  br label %writer
source:
  %j = phi i64 [0, %writer], [%j.next, %following]
  %done = icmp uge i64 %j, %all
  br i1 %done, label %out, label %one
one:
  %line.i = mul i64 %j, 5
  %line = getelementptr i64, ptr %sources, i64 %line.i
  %j.next = add i64 %j, 1
  %number.p = getelementptr i64, ptr %line, i64 4
  %number.a = load ptr, ptr %number.p
  %posted = load i64, ptr %number.a
  %unset = icmp eq i64 %posted, 0
  br i1 %unset, label %following, label %take
take:
  %choice = load i64, ptr %line
  %from.p = getelementptr i64, ptr %line, i64 1
  %from = load ptr, ptr %from.p
  %value = load i64, ptr %from
  %low.p = getelementptr i64, ptr %line, i64 2
  %low = load i64, ptr %low.p
  %reach.p = getelementptr i64, ptr %line, i64 3
  %reach = load i64, ptr %reach.p
  %offset = sub i64 %value, %low
  %inside = icmp ule i64 %offset, %reach
  br i1 %inside, label %store, label %refuse
store:
  %place.i = add i64 %choice, <DEFAULTS>
  %place = getelementptr i64, ptr %c, i64 %place.i
  store i64 %value, ptr %place
  br label %following
refuse:
  %refused = load i64, ptr %refused.p
  %refused.next = add i64 %refused, 1
  store i64 %refused.next, ptr %refused.p
  br label %following
following:
  br label %source
out:
  ret void
}
; What was commanded in the turn before comes no more.
define internal void @over(ptr %c, ptr %t) #1 {
entry:
  %given.p = getelementptr i64, ptr %t, i64 <GIVEN>
  %given = load i64, ptr %given.p
  %none = icmp eq i64 %given, 0
  br i1 %none, label %out, label %reset
reset:
  %old.i = add i64 %given, <DEFAULTS>
  %old.n = sub i64 %old.i, 1
  %old.p = getelementptr i64, ptr %c, i64 %old.n
  store i64 0, ptr %old.p
  store i64 0, ptr %given.p
  br label %out
out:
  ret void
}
; The next command comes, if there is one.
define internal void @command(ptr %c, ptr %t) #1 {
entry:
  %given.p = getelementptr i64, ptr %t, i64 <GIVEN>
  br label %look
look:
  %command.p = getelementptr i64, ptr %t, i64 <COMMAND>
  %command = load ptr, ptr %command.p
  %nobody = icmp eq ptr %command, null
  br i1 %nobody, label %out, label %compare
compare:
  %taken.p = getelementptr i64, ptr %t, i64 <TAKEN>
  %taken = load i64, ptr %taken.p
  %number = load i64, ptr %command
  %same = icmp eq i64 %taken, %number
  br i1 %same, label %out, label %take
take:
  %choice.p = getelementptr i64, ptr %command, i64 1
  %choice = load i64, ptr %choice.p
  %place.i = add i64 %choice, <DEFAULTS>
  %place = getelementptr i64, ptr %c, i64 %place.i
  store i64 1, ptr %place
  %choice.next = add i64 %choice, 1
  store i64 %choice.next, ptr %given.p
  %image.p = getelementptr i64, ptr %t, i64 <IMAGE>
  %image = load ptr, ptr %image.p
  %frame = load i64, ptr %image
  %frame.next = add i64 %frame, 1
  %frame.p = getelementptr i64, ptr %t, i64 <TAKEN_FRAME>
  store i64 %frame.next, ptr %frame.p
  store atomic i64 %number, ptr %taken.p release, align 8
  %kind.p = getelementptr i64, ptr %command, i64 2
  %kind = load i64, ptr %kind.p
  %plain = icmp slt i64 %kind, 0
  br i1 %plain, label %out, label %with
with:
  %value.p = getelementptr i64, ptr %command, i64 3
  %value = load i64, ptr %value.p
  %given.i = add i64 %kind, <DEFAULTS>
  %where = getelementptr i64, ptr %c, i64 %given.i
  store i64 %value, ptr %where
  br label %out
out:
  ret void
}
; Choices get the values that are in force now, which the frame shows.
define internal void @begin(ptr %c, ptr %t) #1 {
  %drawn.p = getelementptr i64, ptr %t, i64 <DRAWN>
  %drawn = load ptr, ptr %drawn.p
  %random.p = getelementptr i64, ptr %t, i64 <RANDOM>
  %begun.p = getelementptr i64, ptr %t, i64 <BEGUN>
  %begun = load i64, ptr %begun.p
  %fresh = icmp eq i64 %begun, 0
  store i64 1, ptr %begun.p
  call void @draw(ptr %c, ptr %drawn, ptr %random.p, i1 %fresh)
  call void @over(ptr %c, ptr %t)
  call void @sources(ptr %c, ptr %t)
  call void @command(ptr %c, ptr %t)
  call void @script(ptr %c, ptr %t, i64 0)
  %image.p = getelementptr i64, ptr %t, i64 <IMAGE>
  %image = load ptr, ptr %image.p
  %defaults = getelementptr i64, ptr %c, i64 <DEFAULTS>
  %choices = getelementptr i64, ptr %image, i64 <AT.CHOICES>
  %bytes = mul i64 <CHOICES>, 8
  call void @llvm.memcpy.p0.p0.i64(ptr %choices, ptr %defaults, i64 %bytes, i1 false)
  ret void
}
; In which states machines are, where somebody wants to know.
define internal void @visit(ptr %r, ptr %c, ptr %t) #1 {
  %visited.p = getelementptr i64, ptr %t, i64 <VISITED>
  %visited = load ptr, ptr %visited.p
  %unasked = icmp eq ptr %visited, null
  br i1 %unasked, label %out, label %look
look:
  call void @visits(ptr %r, ptr %c, ptr %visited)
  br label %out
out:
  ret void
}
; What the ringlet fired, and its events, for the frame.
define internal void @note(ptr %r, ptr %c, ptr %image) #1 {
entry:
  %ran = call i64 @ran(ptr %r, ptr %c)
  %fired = call i64 @fired(ptr %r, ptr %c)
  %somebody = icmp ne i64 %ran, 0
  br i1 %somebody, label %keep, label %look
keep:
  %slot = add i64 %ran, <AT.FIRED>
  %slot.i = sub i64 %slot, 1
  %slot.p = getelementptr i64, ptr %image, i64 %slot.i
  store i64 %fired, ptr %slot.p
  br label %look
look:
  %used.p = getelementptr i64, ptr %c, i64 <C.EVENTS>
  %used = load i64, ptr %used.p
  br label %loop
loop:
  %at = phi i64 [0, %look], [%at.next, %count], [%at.next, %one]
  %over = icmp uge i64 %at, %used
  br i1 %over, label %out, label %one
one:
  %kind.i = add i64 %at, <TABLE>
  %kind.p = getelementptr i64, ptr %c, i64 %kind.i
  %kind = load i64, ptr %kind.p
  %arity.p = getelementptr i64, ptr %kind.p, i64 2
  %arity = load i64, ptr %arity.p
  %size = add i64 %arity, 3
  %at.next = add i64 %at, %size
  %counter.p = getelementptr i64, ptr @counted, i64 %kind
  %counter = load i64, ptr %counter.p
  %is = icmp ult i64 %counter, <COUNTED>
  br i1 %is, label %count, label %loop
count:
  %place.i = add i64 %counter, <AT.EVENTS>
  %place = getelementptr i64, ptr %image, i64 %place.i
  %old = load i64, ptr %place
  %new = add i64 %old, 1
  store i64 %new, ptr %place
  br label %loop
out:
  ret void
}
; The ringlets of one cycle of process %p; the status of the last one. The record is as before a step that failed.
define i32 @turn(ptr %r, ptr %c, ptr %t, i64 %p) #1 {
entry:
  %image.p = getelementptr i64, ptr %t, i64 <IMAGE>
  %image = load ptr, ptr %image.p
  %saved = getelementptr i64, ptr %c, i64 <SAVED>
  %steps.p = getelementptr i64, ptr %image, i64 <H.STEPS>
  %settled.p = getelementptr i64, ptr %t, i64 <SETTLED>
  store i64 0, ptr %settled.p
  br label %loop
loop:
  %k = phi i64 [0, %entry], [%k.next, %good]
  %first = icmp eq i64 %k, 0
  br i1 %first, label %go, label %prescribe
prescribe:
  call void @script(ptr %c, ptr %t, i64 %k)
  br label %go
go:
  call void @llvm.memcpy.p0.p0.i64(ptr %saved, ptr %r, i64 <RECORD>, i1 false)
  %status = call i32 @step(ptr %r, ptr %c, i64 %p)
  %bad = icmp ne i32 %status, 0
  br i1 %bad, label %failed, label %good
failed:
  call void @llvm.memcpy.p0.p0.i64(ptr %r, ptr %saved, i64 <RECORD>, i1 false)
  ret i32 %status
good:
  %k.next = add i64 %k, 1
  %steps = load i64, ptr %steps.p
  %steps.next = add i64 %steps, 1
  store i64 %steps.next, ptr %steps.p
  call void @note(ptr %r, ptr %c, ptr %image)
  call void @visit(ptr %r, ptr %c, ptr %t)
  %complete = call i1 @cycle(ptr %r)
  %new = call i1 @watch(ptr %r, ptr %t, i1 %complete)
  %was = load i64, ptr %settled.p
  %news = zext i1 %new to i64
  %is = or i64 %was, %news
  store i64 %is, ptr %settled.p
  br i1 %complete, label %out, label %loop
out:
  ret i32 0
}
; A byte to each subscriber.
define internal void @wake(ptr %t) #1 {
entry:
  %count.p = getelementptr i64, ptr %t, i64 <WAKE_COUNT>
  %count = load atomic i64, ptr %count.p acquire, align 8
  %rows.p = getelementptr i64, ptr %t, i64 <WAKES>
  %rows = load ptr, ptr %rows.p
  %socket.p = getelementptr i64, ptr %t, i64 <WAKE_SOCKET>
  %socket.64 = load i64, ptr %socket.p
  %socket = trunc i64 %socket.64 to i32
  br label %loop
loop:
  %i = phi i64 [0, %entry], [%i.next, %next]
  %over = icmp uge i64 %i, %count
  br i1 %over, label %out, label %look
look:
  %row.i = shl i64 %i, 4
  %row = getelementptr i64, ptr %rows, i64 %row.i
  %length.64 = load atomic i64, ptr %row acquire, align 8
  %length = trunc i64 %length.64 to i32
  %unused = icmp eq i32 %length, 0
  br i1 %unused, label %next, label %send
send:
  %address = getelementptr i64, ptr %row, i64 1
  %sent = call i64 @sendto(i32 %socket, ptr %row, i64 1, i32 <WITHOUT_WAITING>, ptr %address, i32 %length)
  br label %next
next:
  %i.next = add i64 %i, 1
  br label %loop
out:
  ret void
}
; The frame is complete: record how it differs from the one before, and publish it.
define void @commit(ptr %r, ptr %t) #1 {
entry:
  %image.p = getelementptr i64, ptr %t, i64 <IMAGE>
  %image = load ptr, ptr %image.p
  %n = load i64, ptr %image
  %n.next = add i64 %n, 1
  store i64 %n.next, ptr %image
  %now = call i64 @now()
  %now.p = getelementptr i64, ptr %image, i64 <H.COMMITTED>
  store i64 %now, ptr %now.p
  %record = getelementptr i64, ptr %image, i64 <AT.RECORD>
  call void @llvm.memcpy.p0.p0.i64(ptr %record, ptr %r, i64 <RECORD>, i1 false)
  %states.p = getelementptr i64, ptr %t, i64 <STATES>
  %states = load ptr, ptr %states.p
  %verdicts = getelementptr i64, ptr %image, i64 <AT.MONITORS>
  %bytes = mul i64 <MONITORS>, 8
  call void @llvm.memcpy.p0.p0.i64(ptr %verdicts, ptr %states, i64 %bytes, i1 false)
  %log.p = getelementptr i64, ptr %t, i64 <LOG>
  %log = load ptr, ptr %log.p
  %forgotten = icmp eq ptr %log, null
  br i1 %forgotten, label %recorded, label %write
write:
  call void @varint(ptr %t, i64 0)
  %previous.p = getelementptr i64, ptr %t, i64 <PREVIOUS>
  %previous = load ptr, ptr %previous.p
  br label %loop
loop:
  %i = phi i64 [0, %write], [%i.next, %next]
  %last = phi i64 [-1, %write], [%last.next, %next]
  %over = icmp uge i64 %i, <FRAME>
  br i1 %over, label %close, label %compare
compare:
  %new.p = getelementptr i64, ptr %image, i64 %i
  %old.p = getelementptr i64, ptr %previous, i64 %i
  %new = load i64, ptr %new.p
  %old = load i64, ptr %old.p
  %same = icmp eq i64 %new, %old
  br i1 %same, label %next, label %differ
differ:
  %gap = sub i64 %i, %last
  call void @varint(ptr %t, i64 %gap)
  %change = sub i64 %new, %old
  call void @signed(ptr %t, i64 %change)
  store i64 %new, ptr %old.p
  br label %next
next:
  %last.next = phi i64 [%last, %compare], [%i, %differ]
  %i.next = add i64 %i, 1
  br label %loop
close:
  call void @varint(ptr %t, i64 0)
  %cursor.p = getelementptr i64, ptr %t, i64 <CURSOR>
  %end = load i64, ptr %cursor.p
  %from.p = getelementptr i64, ptr %t, i64 <ENTRY>
  %from = load i64, ptr %from.p
  %begin = inttoptr i64 %from to ptr
  %length = sub i64 %end, %from
  %before.p = getelementptr i8, ptr %begin, i64 -<CHECK_BYTES>
  %before = load i32, ptr %before.p, align 1
  %check = call i32 @checksum(ptr %begin, i64 %length, i32 %before)
  %end.p = inttoptr i64 %end to ptr
  store i32 %check, ptr %end.p, align 1
  %cursor = add i64 %end, <CHECK_BYTES>
  %size = add i64 %length, <CHECK_BYTES>
  %used = load i64, ptr %log
  %used.next = add i64 %used, %size
  store i64 %cursor, ptr %cursor.p
  store i64 %cursor, ptr %from.p
  %bytes.p = getelementptr i64, ptr %t, i64 <RECORDED_BYTES>
  store atomic i64 %used.next, ptr %bytes.p release, align 8
  %frame.p = getelementptr i64, ptr %t, i64 <RECORDED>
  store atomic i64 %n.next, ptr %frame.p release, align 8
  store atomic i64 %used.next, ptr %log release, align 8
  br label %recorded
recorded:
  %segment.p = getelementptr i64, ptr %t, i64 <SEGMENT>
  %segment = load ptr, ptr %segment.p
  %alone = icmp eq ptr %segment, null
  br i1 %alone, label %out, label %show
show:
  call void @publish(ptr %segment, ptr %image, i64 <FRAME>)
  call void @wake(ptr %t)
  br label %out
out:
  ret void
}
; Until the turn may begin; false: told to stop meanwhile.
define internal i1 @wait(ptr %t, i1 %again) #1 {
entry:
  %period.p = getelementptr i64, ptr %t, i64 <PERIOD>
  %period = load i64, ptr %period.p
  %base.p = getelementptr i64, ptr %t, i64 <BASE>
  %base = load i64, ptr %base.p
  %round.p = getelementptr i64, ptr %t, i64 <ROUND>
  %round = load i64, ptr %round.p
  %started.p = getelementptr i64, ptr %t, i64 <STARTED>
  %started = load i64, ptr %started.p
  %jitter.p = getelementptr i64, ptr %t, i64 <JITTER>
  %jitter = load i64, ptr %jitter.p
  %late.p = getelementptr i64, ptr %t, i64 <LATE>
  %time = alloca [2 x i64]
  store i64 0, ptr %late.p
  %free = icmp eq i64 %period, 0
  br i1 %free, label %out, label %plan
plan:
  %elapsed = mul i64 %round, %period
  %due = add i64 %base, %elapsed
  %least = sub i64 %period, %jitter
  %apart = add i64 %started, %least
  %begun = icmp ne i64 %started, 0
  %sooner = icmp slt i64 %due, %apart
  %too.soon.1 = and i1 %begun, %sooner
  %too.soon = and i1 %too.soon.1, %again
  %begin = select i1 %too.soon, i64 %apart, i64 %due
  %rest.p = getelementptr i64, ptr %time, i64 1
  br label %look
look:
  %stop = load atomic i64, ptr %t acquire, align 8
  %told = icmp ne i64 %stop, 0
  br i1 %told, label %stopped, label %check
check:
  %now = call i64 @now()
  %ready = icmp sge i64 %now, %begin
  br i1 %ready, label %go, label %sleep
sleep:
  %soon = add i64 %now, <NAP>
  %first.look = call i64 @llvm.umin.i64(i64 %soon, i64 %begin)
  %seconds = udiv i64 %first.look, 1000000000
  %rest = urem i64 %first.look, 1000000000
  store i64 %seconds, ptr %time
  store i64 %rest, ptr %rest.p
  %slept = call i32 @clock_nanosleep(i32 <CLOCK_MONOTONIC>, i32 <TIMER_ABSTIME>, ptr %time, ptr null)
  br label %look
go:
  %late = sub i64 %now, %due
  store i64 %late, ptr %late.p
  br i1 %again, label %first, label %out
first:
  store i64 %now, ptr %started.p
  call void @lateness(ptr %t, i64 %late, i64 %period)
  br label %out
out:
  ret i1 true
stopped:
  ret i1 false
}
define internal void @lateness(ptr %t, i64 %late, i64 %period) #1 {
entry:
  %worst.p = getelementptr i64, ptr %t, i64 <WORST>
  %worst = load i64, ptr %worst.p
  %worse = icmp sgt i64 %late, %worst
  %worst.next = select i1 %worse, i64 %late, i64 %worst
  store i64 %worst.next, ptr %worst.p
  %zeros = call i64 @llvm.ctlz.i64(i64 %late, i1 false)
  %exponent = sub i64 63, %zeros
  %small = icmp ult i64 %late, 8
  %octave = sub i64 %exponent, 2
  %eighths = sub i64 %exponent, 3
  %shift = select i1 %small, i64 0, i64 %eighths
  %shifted = lshr i64 %late, %shift
  %part = and i64 %shifted, 7
  %row = shl i64 %octave, 3
  %large = add i64 %row, %part
  %bucket = select i1 %small, i64 %late, i64 %large
  %histogram.p = getelementptr i64, ptr %t, i64 <HISTOGRAM>
  %histogram = load ptr, ptr %histogram.p
  %place = getelementptr i64, ptr %histogram, i64 %bucket
  %old = load i64, ptr %place
  %new = add i64 %old, 1
  store i64 %new, ptr %place
  %over = icmp sge i64 %late, %period
  br i1 %over, label %move, label %out
move:
  %overruns.p = getelementptr i64, ptr %t, i64 <OVERRUNS>
  %overruns = load i64, ptr %overruns.p
  %overruns.next = add i64 %overruns, 1
  store i64 %overruns.next, ptr %overruns.p
  %base.p = getelementptr i64, ptr %t, i64 <BASE>
  %base = load i64, ptr %base.p
  %base.next = add i64 %base, %late
  store i64 %base.next, ptr %base.p
  %image.p = getelementptr i64, ptr %t, i64 <IMAGE>
  %image = load ptr, ptr %image.p
  %moved.p = getelementptr i64, ptr %image, i64 <H.MOVED>
  %moved = load i64, ptr %moved.p
  %moved.next = add i64 %moved, %late
  store i64 %moved.next, ptr %moved.p
  br label %out
out:
  ret void
}
declare i64 @llvm.ctlz.i64(i64, i1)
declare i64 @llvm.umin.i64(i64, i64)
; Turn after turn; the control block says why it returns.
define i64 @live(ptr %r, ptr %c, ptr %t) #1 {
entry:
  %turns.p = getelementptr i64, ptr %t, i64 <TURNS>
  %last.p = getelementptr i64, ptr %t, i64 <LAST>
  %round.p = getelementptr i64, ptr %t, i64 <ROUND>
  %process.p = getelementptr i64, ptr %c, i64 <C.PROCESS>
  %status.p = getelementptr i64, ptr %c, i64 <C.STATUS>
  %log.p = getelementptr i64, ptr %t, i64 <LOG>
  %limit.p = getelementptr i64, ptr %t, i64 <LIMIT>
  %cursor.p = getelementptr i64, ptr %t, i64 <CURSOR>
  %overruns.p = getelementptr i64, ptr %t, i64 <OVERRUNS>
  %strict.p = getelementptr i64, ptr %t, i64 <STRICT>
  %settle.p = getelementptr i64, ptr %t, i64 <UNTIL_SETTLED>
  %settled.p = getelementptr i64, ptr %t, i64 <SETTLED>
  %late.p = getelementptr i64, ptr %t, i64 <LATE>
  %image.p = getelementptr i64, ptr %t, i64 <IMAGE>
  %image = load ptr, ptr %image.p
  %fired.p = getelementptr i64, ptr %image, i64 <AT.FIRED>
  %fired.bytes = mul i64 <SLOTS>, 8
  %lateness.p = getelementptr i64, ptr %image, i64 <H.LATENESS>
  %whose.p = getelementptr i64, ptr %image, i64 <H.PROCESS>
  %cycle.p = getelementptr i64, ptr %image, i64 <H.CYCLE>
  br label %again
again:
  %stop = load atomic i64, ptr %t acquire, align 8
  %told = icmp ne i64 %stop, 0
  br i1 %told, label %out, label %limit
limit:
  %turns = load i64, ptr %turns.p
  %spent = icmp eq i64 %turns, 0
  br i1 %spent, label %out, label %room
room:
  %log = load ptr, ptr %log.p
  %silent = icmp eq ptr %log, null
  br i1 %silent, label %choose, label %measure
measure:
  %cursor = load i64, ptr %cursor.p
  %room.end = load i64, ptr %limit.p
  %wanted = add i64 %cursor, <LARGEST>
  %full = icmp ugt i64 %wanted, %room.end
  br i1 %full, label %out, label %choose
choose:
  %p = call i64 @pick(ptr %r, ptr %c)
  %nobody = icmp uge i64 %p, <PROCESSES>
  br i1 %nobody, label %out, label %due
due:
  %last = load i64, ptr %last.p
  %new.round = icmp sle i64 %p, %last
  %started = icmp sge i64 %last, 0
  %rounds = and i1 %new.round, %started
  %round = load i64, ptr %round.p
  %one = zext i1 %rounds to i64
  %round.next = add i64 %round, %one
  %rounds.p = getelementptr i64, ptr %t, i64 <ROUNDS>
  %limit.rounds = load i64, ptr %rounds.p
  %over.rounds = icmp uge i64 %round.next, %limit.rounds
  br i1 %over.rounds, label %out, label %whose
whose:
  %mine.p = getelementptr i64, ptr %t, i64 <MINE>
  %mine = load i64, ptr %mine.p
  %all.mine = icmp slt i64 %mine, 0
  %is.mine = icmp eq i64 %mine, %p
  %here = or i1 %all.mine, %is.mine
  %next.p = getelementptr i64, ptr %t, i64 <NEXT>
  store i64 %p, ptr %next.p
  br i1 %here, label %within, label %out
within:
  %fresh = xor i1 %started, true
  %head = or i1 %rounds, %fresh
  store i64 %round.next, ptr %round.p
  %overruns.before = load i64, ptr %overruns.p
  %ready = call i1 @wait(ptr %t, i1 %head)
  br i1 %ready, label %check, label %back
back:
  store i64 %round, ptr %round.p
  br label %out
check:
  %overruns = load i64, ptr %overruns.p
  %over = icmp ne i64 %overruns, %overruns.before
  %strict = load i64, ptr %strict.p
  %is.strict = icmp ne i64 %strict, 0
  %halt = and i1 %over, %is.strict
  br i1 %halt, label %out, label %go
go:
  store i64 %p, ptr %last.p
  store i64 %p, ptr %whose.p
  store i64 %round.next, ptr %cycle.p
  %late = load i64, ptr %late.p
  store i64 %late, ptr %lateness.p
  call void @llvm.memset.p0.i64(ptr %fired.p, i8 0, i64 %fired.bytes, i1 false)
  call void @begin(ptr %c, ptr %t)
  %status = call i32 @turn(ptr %r, ptr %c, ptr %t, i64 %p)
  %bad = icmp ne i32 %status, 0
  br i1 %bad, label %failed, label %done
failed:
  %status.64 = sext i32 %status to i64
  store i64 %status.64, ptr %status.p
  br label %out
done:
  %p.next = add i64 %p, 1
  store i64 %p.next, ptr %process.p
  call void @commit(ptr %r, ptr %t)
  %left = sub i64 %turns, 1
  store i64 %left, ptr %turns.p
  %settle = load i64, ptr %settle.p
  %settled = load i64, ptr %settled.p
  %both = and i64 %settle, %settled
  %decided = icmp ne i64 %both, 0
  br i1 %decided, label %out, label %again
out:
  %reason = phi i64 [<TOLD>, %again], [<DONE>, %limit], [<FULL>, %measure], [<ENDED>, %choose], [<DONE>, %due],
    [<HANDED>, %whose], [<TOLD>, %back],
    [<OVERRUN>, %check], [<FAILED>, %failed], [<DECIDED>, %done]
  ret i64 %reason
}
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
