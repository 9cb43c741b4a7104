; The quotient of two numbers without a sign, bit by bit as on paper; most fit in 64 bits.
declare i128 @llvm.ctlz.i128(i128, i1)
define internal i128 @quotient(i128 %a, i128 %b) noinline nounwind {
entry:
  %both = or i128 %a, %b
  %high = lshr i128 %both, 64
  %small = icmp eq i128 %high, 0
  br i1 %small, label %short, label %long
short:
  %a64 = trunc i128 %a to i64
  %b64 = trunc i128 %b to i64
  %q64 = udiv i64 %a64, %b64
  %narrow = zext i64 %q64 to i128
  ret i128 %narrow
long:
  %zeros = call i128 @llvm.ctlz.i128(i128 %a, i1 false)
  %steps = sub i128 128, %zeros
  %none = icmp eq i128 %steps, 0
  br i1 %none, label %nothing, label %begin
nothing:
  ret i128 0
begin:
  %shifted = shl i128 %a, %zeros
  br label %loop
loop:
  %left = phi i128 [%steps, %begin], [%left.next, %loop]
  %digits = phi i128 [%shifted, %begin], [%digits.next, %loop]
  %rest = phi i128 [0, %begin], [%rest.next, %loop]
  %result = phi i128 [0, %begin], [%result.next, %loop]
  %top = lshr i128 %digits, 127
  %digits.next = shl i128 %digits, 1
  %carry = icmp slt i128 %rest, 0
  %doubled = shl i128 %rest, 1
  %grown = or i128 %doubled, %top
  %reached = icmp uge i128 %grown, %b
  %one = or i1 %carry, %reached
  %less = sub i128 %grown, %b
  %rest.next = select i1 %one, i128 %less, i128 %grown
  %bit = zext i1 %one to i128
  %moved = shl i128 %result, 1
  %result.next = or i128 %moved, %bit
  %left.next = sub i128 %left, 1
  %more = icmp ne i128 %left.next, 0
  br i1 %more, label %loop, label %done
done:
  ret i128 %result.next
}
