; Choices: sampled in a step, and drawn before it. `kernel.py` has the numbers for the words in angle brackets.
; xorshift64* (S. Vigna, An experimental exploration of Marsaglia's xorshift generators, scrambled, 2016), scaled to
; %size by the high word of a product; 0: not scaled.
define internal i64 @random(ptr %c, i64 %size) #1 {
  %x0 = load i64, ptr %c
  %x1 = lshr i64 %x0, 12
  %x2 = xor i64 %x0, %x1
  %x3 = shl i64 %x2, 25
  %x4 = xor i64 %x2, %x3
  %x5 = lshr i64 %x4, 27
  %x6 = xor i64 %x4, %x5
  store i64 %x6, ptr %c
  %x7 = mul i64 %x6, 2685821657736338717
  %whole = icmp eq i64 %size, 0
  %wide = zext i64 %x7 to i128
  %factor = zext i64 %size to i128
  %product = mul i128 %wide, %factor
  %high = lshr i128 %product, 64
  %scaled = trunc i128 %high to i64
  %result = select i1 %whole, i64 %x7, i64 %scaled
  ret i64 %result
}
define internal i64 @among(ptr %random, ptr %low.p, ptr %size.p) #1 {
  %size = load i64, ptr %size.p
  %offset = call i64 @random(ptr %random, i64 %size)
  %low = load i64, ptr %low.p
  %value = add i64 %low, %offset
  ret i64 %value
}
; The value of a choice in this step: the one it was first read with; else the next prescribed one; else a random one,
; or its default.
define internal i64 @sample(ptr %c, i64 %choice) memory(argmem: readwrite) nounwind {
  %step.p = getelementptr i64, ptr %c, i64 <C.STEP>
  %step = load i64, ptr %step.p
  %stamp.i = add i64 %choice, <STAMPS>
  %stamp.p = getelementptr i64, ptr %c, i64 %stamp.i
  %stamp = load i64, ptr %stamp.p
  %value.i = add i64 %choice, <VALUES>
  %value.p = getelementptr i64, ptr %c, i64 %value.i
  %known = icmp eq i64 %stamp, %step
  br i1 %known, label %again, label %first
again:
  %old = load i64, ptr %value.p
  ret i64 %old
first:
  store i64 %step, ptr %stamp.p
  %n.p = getelementptr i64, ptr %c, i64 <C.SAMPLES>
  %n = load i64, ptr %n.p
  %n1 = add i64 %n, 1
  store i64 %n1, ptr %n.p
  %twice = shl i64 %n, 1
  %pair.i = add i64 %twice, <SAMPLES>
  %pair.p = getelementptr i64, ptr %c, i64 %pair.i
  %pair.v = getelementptr i64, ptr %pair.p, i64 1
  %prefix.p = getelementptr i64, ptr %c, i64 <C.PREFIX>
  %prefix = load i64, ptr %prefix.p
  %given = icmp ult i64 %n, %prefix
  br i1 %given, label %prescribed, label %open
prescribed:
  %told = load i64, ptr %pair.v
  br label %done
open:
  %seed = load i64, ptr %c
  %fixed = icmp eq i64 %seed, 0
  br i1 %fixed, label %default, label %free
free:
  %table.p = getelementptr i64, ptr %c, i64 <C.DRAWN>
  %table = load i64, ptr %table.p
  %anew = icmp eq i64 %table, 0
  br i1 %anew, label %drawn, label %default
default:
  %default.i = add i64 %choice, <DEFAULTS>
  %default.p = getelementptr i64, ptr %c, i64 %default.i
  %preset = load i64, ptr %default.p
  br label %done
drawn:
  %size.p = getelementptr i64, ptr @sizes, i64 %choice
  %low.p = getelementptr i64, ptr @lows, i64 %choice
  %random = call i64 @among(ptr %c, ptr %low.p, ptr %size.p)
  br label %done
done:
  %value = phi i64 [%told, %prescribed], [%preset, %default], [%random, %drawn]
  store i64 %choice, ptr %pair.p
  store i64 %value, ptr %pair.v
  store i64 %value, ptr %value.p
  ret i64 %value
}
; The choices of a table (`runtime.stepping.drawing`) keep their values or get new ones; where %fresh all get new
; ones.
define internal void @draw(ptr %c, ptr %table, ptr %random, i1 %fresh) #1 {
entry:
  %never = icmp eq ptr %table, null
  br i1 %never, label %out, label %loop
loop:
  %i = phi i64 [0, %entry], [%i.next, %next]
  %over = icmp uge i64 %i, <CHOICES>
  br i1 %over, label %out, label %look
look:
  %row.i = mul i64 %i, 3
  %row = getelementptr i64, ptr %table, i64 %row.i
  %like = load i64, ptr %row
  %place.i = add i64 %i, <DEFAULTS>
  %place = getelementptr i64, ptr %c, i64 %place.i
  %itself = icmp eq i64 %like, %i
  br i1 %itself, label %own, label %other
other:
  %on = icmp sge i64 %like, 0
  br i1 %on, label %copy, label %next
copy:
  %model.i = add i64 %like, <DEFAULTS>
  %model.p = getelementptr i64, ptr %c, i64 %model.i
  %model = load i64, ptr %model.p
  store i64 %model, ptr %place
  br label %next
own:
  %keep.p = getelementptr i64, ptr %row, i64 1
  %keep = load i64, ptr %keep.p
  %holds = icmp ne i64 %keep, 0
  %old = xor i1 %fresh, true
  %held = and i1 %holds, %old
  br i1 %held, label %chance, label %pick
chance:
  %luck = call i64 @random(ptr %random, i64 0)
  %stays = icmp ult i64 %luck, %keep
  br i1 %stays, label %next, label %pick
pick:
  %pieces.p = getelementptr i64, ptr %row, i64 2
  %pieces = load i64, ptr %pieces.p
  %even = icmp eq i64 %pieces, 0
  br i1 %even, label %whole, label %weigh
whole:
  %size.p = getelementptr i64, ptr @sizes, i64 %i
  %low.p = getelementptr i64, ptr @lows, i64 %i
  br label %put
weigh:
  %word = call i64 @random(ptr %random, i64 0)
  br label %piece
piece:
  %at = phi i64 [%pieces, %weigh], [%at.next, %piece]
  %at.next = add i64 %at, 3
  %until.p = getelementptr i64, ptr %table, i64 %at
  %until = load i64, ptr %until.p
  %within = icmp ule i64 %word, %until
  %from.p = getelementptr i64, ptr %until.p, i64 1
  %many.p = getelementptr i64, ptr %until.p, i64 2
  br i1 %within, label %put, label %piece
put:
  %low.at = phi ptr [%low.p, %whole], [%from.p, %piece]
  %size.at = phi ptr [%size.p, %whole], [%many.p, %piece]
  %value = call i64 @among(ptr %random, ptr %low.at, ptr %size.at)
  store i64 %value, ptr %place
  br label %next
next:
  %i.next = add i64 %i, 1
  br label %loop
out:
  ret void
}
