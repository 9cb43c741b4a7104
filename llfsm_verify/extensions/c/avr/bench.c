#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>

static void put(char letter)
{
    while ((UCSR0A & _BV(UDRE0)) == 0) {
    }
    UDR0 = (uint8_t)letter;
}

#define WINDOW 256
#define PAINT 0xC5
static volatile uint16_t overflows;
static uint32_t largest;
static uint16_t deepest;
extern uint8_t __heap_start;

ISR(TIMER1_OVF_vect)
{
    overflows++;
}

static uint32_t ticks(void)
{
    const uint16_t low = TCNT1;
    return (uint32_t)overflows << 16 | low;
}

/* One call, with its CPU cycles and the bytes of its stack. */
static __attribute__((noinline)) NAME_status called(void)
{
    NAME_status status;
    uint32_t taken;
    uint16_t none;
    uint8_t *const top = (uint8_t *)SP;
    uint16_t i;
    const uint16_t room = (uint16_t)(top - &__heap_start);
    const uint16_t window = room < WINDOW ? room : WINDOW;
    cli();
    for (i = 0; i < window; i++) {
        *(volatile uint8_t *)(top - i) = PAINT;
    }
    TCCR1B = 0;
    TCNT1 = 0;
    TCCR1B = _BV(CS10);
    none = TCNT1;
    TCCR1B = 0;
    TCNT1 = 0;
    overflows = 0;
    TIFR1 = _BV(TOV1);
    sei();
    TCCR1B = _BV(CS10);
    status = CALL(&state, &inputs);
    taken = ticks() - none;
    cli();
    for (i = window; i > 0 && *(volatile uint8_t *)(top - (i - 1)) == PAINT; i--) {
    }
    deepest = i > deepest ? i : deepest;
    largest = taken > largest ? taken : largest;
    return status;
}

static void set_up(void)
{
    UBRR0 = 0;
    UCSR0B = _BV(TXEN0);
    TIMSK1 = _BV(TOIE1);
}

static void tell_costs(void)
{
    put_word("cost");
    put_hex(largest);
    put_hex(deepest);
    put('\n');
}

static int end(int code)
{
    cli();
    for (;;) {
        sleep_enable();
        sleep_cpu();
    }
    return code;
}
