/* Run vectors on the image, and compare each field of each record with what is expected. */
#include "NAME.h"

#include <string.h>

@TYPES@

static NAME_state state;
static NAME_inputs inputs;
static void put_word(const char *word);
static void put_hex(longest told);

/* Of the machine: `put` a letter, the image `called`, `set_up`, `tell_costs`, `end`. */
@BOARD@

/* Numbers of @NUMBER_BYTES@ bytes and values of @VALUE_BYTES@ bytes, the lowest first. A sequence: 0 where it begins as
   the image does, 1 where it goes on from the fields that follow; then its steps. A step: how many inputs change, which
   and to what; then how many fields change, which and to what. LAST in place of the first: the sequence ends; in place
   of the second: the step ends with the fault that follows. */
#define LAST ((number)-1)
static const uint8_t vectors[] PROGMEM = {
@VECTORS@
};
static const uint8_t initial[] PROGMEM = {
@INITIAL@
};

static const uint8_t *at = vectors;
static NAME_state before;
static uint32_t sequences;
static uint32_t steps;

@ACCESS@

static value take(uint8_t bytes)
{
    value taken = 0;
    uint8_t i;
    for (i = 0; i < bytes; i++) {
        taken = (value)(taken | (value)((value)pgm_read_byte(at) << 8 * i));
        at++;
    }
    return taken;
}

static number take_number(void)
{
    number taken = pgm_read_byte(at);
    at++;
#if @NUMBER_BYTES@ > 1
    taken = (number)(taken | pgm_read_byte(at) << 8);
    at++;
#endif
    return taken;
}

static void put_word(const char *word)
{
    for (; *word != '\0'; word++) {
        put(*word);
    }
}

/* A blank and a number in hexadecimal. */
static void put_hex(longest told)
{
    uint8_t digits = 2 * sizeof told;
    put(' ');
    while (digits > 0) {
        const uint8_t digit = (uint8_t)((told >> 4 * --digits) & 15);
        put((char)(digit < 10 ? '0' + digit : 'a' + digit - 10));
    }
}

static void differs(uint32_t step, longest field, longest expected, longest found)
{
    put_word("differs");
    put_hex(sequences);
    put_hex(step);
    put_hex(field);
    put_hex(expected);
    put_hex(found);
    put('\n');
}

/* Whether all fields are as before, but for those that follow. */
static bool same(uint32_t step, number changed)
{
    number next = changed > 0 ? take_number() : LAST;
    number i;
    for (i = 0; i < FIELDS; i++) {
        const value found = field_of(&state, i);
        value expected = field_of(&before, i);
        if (i == next) {
            expected = take(sizeof(value));
            changed--;
            next = changed > 0 ? take_number() : LAST;
        }
        if (found != expected) {
            differs(step, i, expected, found);
            return false;
        }
    }
    return true;
}

/* A sequence; whether all is as expected. */
static bool played(void)
{
    const bool goes_on = take_number() != 0;
    const uint8_t *following = at;
    uint32_t step = 0;
    number i;
    memset(&state, 0xA5, sizeof state); /* whatever was in memory */
    memset(&inputs, 0xA5, sizeof inputs);
    NAME_init(&state);
    NAME_first(&inputs);
    before = state;
    at = initial;
    if (!same(step, FIELDS)) {
        return false;
    }
    at = following;
    for (i = 0; goes_on && i < FIELDS; i++) {
        set_field(&state, i, take(sizeof(value)));
    }
    for (;;) {
        number changes = take_number();
        NAME_status expected = NAME_OK;
        NAME_status status;
        if (changes == LAST) {
            return true;
        }
        for (; changes > 0; changes--) {
            const number which = take_number();
            give(&inputs, which, take(sizeof(value)));
        }
        step++;
        steps++;
        before = state;
        status = called();
        changes = take_number();
        if (changes == LAST) {
            const uint8_t low = pgm_read_byte(at);
            const uint8_t high = pgm_read_byte(at + 1);
            at += 2;
            expected = (NAME_status)(int16_t)(uint16_t)(low | (uint16_t)((uint16_t)high << 8));
            changes = 0;
            NAME_safe(&before);
#if !RINGLETS
            before = state; /* its ringlets before the fault are done */
#endif
        }
        if (status != expected) {
            differs(step, LAST, (longest)expected, (longest)status);
            return false;
        }
        if (!same(step, changes)) {
            return false;
        }
    }
}

int main(void)
{
    set_up();
    if (NAME_layout() != NAME_LAYOUT) {
        put_word("layout\n");
        return end(1);
    }
    for (sequences = 0; sequences < SEQUENCES; sequences++) {
        if (!played()) {
            return end(1);
        }
    }
    put_word("ok");
    put_hex(steps);
    put('\n');
    tell_costs();
    return end(0);
}
