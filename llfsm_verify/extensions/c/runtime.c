/* @signed64: The number that a word stands for in two's complement. */
static inline int64_t signed64(uint64_t word)
{
    return word <= (uint64_t)INT64_MAX ? (int64_t)word : -(int64_t)(UINT64_MAX - word) - 1;
}

/* @signed32: The same for 32 bits. */
static inline int32_t signed32(uint32_t word)
{
    return word <= (uint32_t)INT32_MAX ? (int32_t)word : (int32_t)(-(int32_t)(UINT32_MAX - word) - 1);
}

/* @wrap64 signed64: A value brought into the range from `low` whose size is `mask` + 1. */
static inline int64_t wrap64(uint64_t value, uint64_t low, uint64_t mask)
{
    return signed64(((value - low) & mask) + low);
}

/* @wrap32 signed32: The same for 32 bits. */
static inline int32_t wrap32(uint32_t value, uint32_t low, uint32_t mask)
{
    return signed32((uint32_t)(((value - low) & mask) + low));
}

/* @add64: Returns false where the sum leaves 64 bits. */
static inline bool add64(int64_t a, int64_t b, int64_t *sum)
{
    if (b > 0 ? a > INT64_MAX - b : a < INT64_MIN - b) {
        return false;
    }
    *sum = a + b;
    return true;
}

/* @sub64: Returns false where the difference leaves 64 bits. */
static inline bool sub64(int64_t a, int64_t b, int64_t *difference)
{
    if (b > 0 ? a < INT64_MIN + b : a > INT64_MAX + b) {
        return false;
    }
    *difference = a - b;
    return true;
}

/* @mul64: Returns false where the product leaves 64 bits. */
static inline bool mul64(int64_t a, int64_t b, int64_t *product)
{
    if (a == 0 || b == 0) {
        *product = 0;
        return true;
    }
    if (a > 0 ? (b > 0 ? a > INT64_MAX / b : b < INT64_MIN / a)
              : (b > 0 ? a < INT64_MIN / b : a < INT64_MAX / b)) {
        return false;
    }
    *product = a * b;
    return true;
}

/* @div64: Returns false where the quotient leaves 64 bits. */
static inline bool div64(int64_t a, int64_t b, int64_t *quotient)
{
    if (a == INT64_MIN && b == -1) {
        return false;
    }
    *quotient = a / b;
    return true;
}

/* @abs64: Returns false where the size leaves 64 bits. */
static inline bool abs64(int64_t a, int64_t *size)
{
    if (a == INT64_MIN) {
        return false;
    }
    *size = a < 0 ? -a : a;
    return true;
}

/* @mod64: The remainder, also of the smallest number by -1. */
static inline int64_t mod64(int64_t a, int64_t b)
{
    return b == -1 ? 0 : a % b;
}

/* @wide: 128 bits in two halves, in two's complement or without a sign. */
typedef struct {
    uint64_t high;
    uint64_t low;
} wide;

/* @wide_of wide: */
static inline wide wide_of(uint64_t high, uint64_t low)
{
    wide made;
    made.high = high;
    made.low = low;
    return made;
}

/* @wide_signed wide_of: */
static inline wide wide_signed(int64_t value)
{
    return wide_of(value < 0 ? UINT64_MAX : 0, (uint64_t)value);
}

/* @wide_fits wide: Whether it fits in 64 bits with a sign. */
static inline bool wide_fits(wide a, bool has_sign)
{
    if (a.low > (uint64_t)INT64_MAX) {
        return has_sign && a.high == UINT64_MAX;
    }
    return a.high == 0;
}

/* @wide_add wide_of: */
static inline wide wide_add(wide a, wide b)
{
    uint64_t low = a.low + b.low;
    return wide_of(a.high + b.high + (low < a.low ? 1 : 0), low);
}

/* @wide_neg wide_of: */
static inline wide wide_neg(wide a)
{
    return wide_of(~a.high + (a.low == 0 ? 1 : 0), ~a.low + 1);
}

/* @wide_sub wide_add wide_neg: */
static inline wide wide_sub(wide a, wide b)
{
    return wide_add(a, wide_neg(b));
}

/* @wide_mul wide_of: */
static inline wide wide_mul(wide a, wide b)
{
    const uint64_t half = UINT32_MAX;
    uint64_t low = (a.low & half) * (b.low & half);
    uint64_t first = (a.low >> 32) * (b.low & half) + (low >> 32);
    uint64_t second = (a.low & half) * (b.low >> 32) + (first & half);
    uint64_t high = (a.low >> 32) * (b.low >> 32) + (first >> 32) + (second >> 32);
    return wide_of(high + a.high * b.low + a.low * b.high, (second << 32) | (low & half));
}

/* @wide_negative wide: */
static inline bool wide_negative(wide a, bool has_sign)
{
    return has_sign && (a.high >> 63) != 0;
}

/* @wide_less wide_negative: Whether a < b, each with a sign or without. */
static inline bool wide_less(wide a, bool a_has_sign, wide b, bool b_has_sign)
{
    bool negative = wide_negative(a, a_has_sign);
    if (negative != wide_negative(b, b_has_sign)) {
        return negative;
    }
    return a.high != b.high ? a.high < b.high : a.low < b.low;
}

/* @wide_equal wide_negative: */
static inline bool wide_equal(wide a, bool a_has_sign, wide b, bool b_has_sign)
{
    return a.high == b.high && a.low == b.low && wide_negative(a, a_has_sign) == wide_negative(b, b_has_sign);
}

/* @wide_min wide_less: */
static inline wide wide_min(wide a, bool a_has_sign, wide b, bool b_has_sign)
{
    return wide_less(a, a_has_sign, b, b_has_sign) ? a : b;
}

/* @wide_max wide_less: */
static inline wide wide_max(wide a, bool a_has_sign, wide b, bool b_has_sign)
{
    return wide_less(a, a_has_sign, b, b_has_sign) ? b : a;
}

/* @wide_abs wide_negative wide_neg: */
static inline wide wide_abs(wide a, bool has_sign)
{
    return wide_negative(a, has_sign) ? wide_neg(a) : a;
}

/* @wide_quotient wide_sub wide_less: Bit by bit, of numbers without a sign. */
static wide wide_quotient(wide a, wide b)
{
    wide quotient = wide_of(0, 0);
    wide rest = wide_of(0, 0);
    int_fast16_t left;
    for (left = 128; left > 0; left--) {
        rest = wide_of((rest.high << 1) | (rest.low >> 63), (rest.low << 1) | (a.high >> 63));
        a = wide_of((a.high << 1) | (a.low >> 63), a.low << 1);
        quotient = wide_of((quotient.high << 1) | (quotient.low >> 63), quotient.low << 1);
        if (!wide_less(rest, false, b, false)) {
            rest = wide_sub(rest, b);
            quotient.low |= 1;
        }
    }
    return quotient;
}

/* @wide_div wide_quotient wide_abs: Towards zero. */
static wide wide_div(wide a, wide b, bool has_sign)
{
    wide quotient = wide_quotient(wide_abs(a, has_sign), wide_abs(b, has_sign));
    return wide_negative(a, has_sign) == wide_negative(b, has_sign) ? quotient : wide_neg(quotient);
}

/* @wide_mod wide_div wide_mul: */
static wide wide_mod(wide a, wide b, bool has_sign)
{
    return wide_sub(a, wide_mul(wide_div(a, b, has_sign), b));
}
