; Frames from their writer to their readers. `generations.py` says how, and has the numbers for the words in angle brackets.
define internal ptr @generation(ptr %segment, i64 %n, i64 %words) nounwind {
  %stride.1 = add i64 %words, <LINE_WORDS>
  %stride = and i64 %stride.1, -<LINE_WORDS>
  %g = and i64 %n, <LAST_GENERATION>
  %offset = mul i64 %g, %stride
  %at = add i64 %offset, <HEADER_WORDS>
  %place = getelementptr i64, ptr %segment, i64 %at
  ret ptr %place
}
; The frame %image, whose first word is its number, becomes the newest one of the segment.
define void @publish(ptr %segment, ptr %image, i64 %words) nounwind {
entry:
  %n = load i64, ptr %image
  %stamp = call ptr @generation(ptr %segment, i64 %n, i64 %words)
  store atomic i64 0, ptr %stamp monotonic, align 8
  fence release
  br label %loop
loop:
  %i = phi i64 [0, %entry], [%i.next, %loop]
  %i.next = add i64 %i, 1
  %from = getelementptr i64, ptr %image, i64 %i
  %to = getelementptr i64, ptr %stamp, i64 %i.next
  %word = load i64, ptr %from
  store atomic i64 %word, ptr %to monotonic, align 8
  %more = icmp ult i64 %i.next, %words
  br i1 %more, label %loop, label %out
out:
  store atomic i64 %n, ptr %stamp release, align 8
  %newest = getelementptr i64, ptr %segment, i64 <NEWEST>
  store atomic i64 %n, ptr %newest release, align 8
  ret void
}
; Copies frame %n into %copy; whether it is there, whole.
define zeroext i1 @frame(ptr %segment, ptr %copy, i64 %words, i64 %n) nounwind {
look:
  %stamp = call ptr @generation(ptr %segment, i64 %n, i64 %words)
  %before = load atomic i64, ptr %stamp acquire, align 8
  %same = icmp eq i64 %before, %n
  br i1 %same, label %loop, label %gone
loop:
  %i = phi i64 [0, %look], [%i.next, %loop]
  %i.next = add i64 %i, 1
  %from = getelementptr i64, ptr %stamp, i64 %i.next
  %to = getelementptr i64, ptr %copy, i64 %i
  %word = load atomic i64, ptr %from monotonic, align 8
  store i64 %word, ptr %to
  %more = icmp ult i64 %i.next, %words
  br i1 %more, label %loop, label %check
check:
  fence acquire
  %after = load atomic i64, ptr %stamp monotonic, align 8
  %whole = icmp eq i64 %after, %n
  ret i1 %whole
gone:
  ret i1 false
}
; Word %i of the newest frame, which there is, or, after so many tries, of one of those that came after it.
define i64 @word(ptr %segment, i64 %words, i64 %i) nounwind {
entry:
  %newest = getelementptr i64, ptr %segment, i64 <NEWEST>
  %after.stamp = add i64 %i, 1
  br label %again
again:
  %try = phi i64 [1, %entry], [%try.next, %again]
  %try.next = add i64 %try, 1
  %n = load atomic i64, ptr %newest acquire, align 8
  %stamp = call ptr @generation(ptr %segment, i64 %n, i64 %words)
  %before = load atomic i64, ptr %stamp acquire, align 8
  %from = getelementptr i64, ptr %stamp, i64 %after.stamp
  %word = load atomic i64, ptr %from monotonic, align 8
  fence acquire
  %after = load atomic i64, ptr %stamp monotonic, align 8
  %same.1 = icmp eq i64 %before, %n
  %same.2 = icmp eq i64 %after, %n
  %whole = and i1 %same.1, %same.2
  %enough = icmp uge i64 %try, <TRIES>
  %over = or i1 %whole, %enough
  br i1 %over, label %out, label %again
out:
  ret i64 %word
}
; Copies the newest frame into %copy and returns its number; 0: there is none yet, or none that is whole.
define i64 @newest(ptr %segment, ptr %copy, i64 %words) nounwind {
entry:
  %newest = getelementptr i64, ptr %segment, i64 <NEWEST>
  br label %again
again:
  %try = phi i64 [1, %entry], [%try.next, %torn]
  %n = load atomic i64, ptr %newest acquire, align 8
  %none = icmp eq i64 %n, 0
  br i1 %none, label %out, label %look
look:
  %whole = call i1 @frame(ptr %segment, ptr %copy, i64 %words, i64 %n)
  br i1 %whole, label %out, label %torn
torn:
  %try.next = add i64 %try, 1
  %enough = icmp uge i64 %try, <TRIES>
  br i1 %enough, label %out, label %again
out:
  %number = phi i64 [0, %again], [%n, %look], [0, %torn]
  ret i64 %number
}
