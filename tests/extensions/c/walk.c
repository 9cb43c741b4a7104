/* Numbers by chance, hexadecimal words, and where characters go on each kind of machine. */
#include "walk.h"

/* xorshift64*: S. Vigna, An experimental exploration of Marsaglia's xorshift generators, scrambled, 2016. */
uint64_t chance(uint64_t *seed)
{
    uint64_t x = *seed;
    x ^= x >> 12;
    x ^= x << 25;
    x ^= x >> 27;
    *seed = x;
    return x * UINT64_C(2685821657736338717);
}

/* One of `size` numbers from `low`, often the first, the last or one near 0; a size of 0 means all words. */
uint64_t pick(uint64_t *seed, uint64_t low, uint64_t size)
{
    uint64_t kind = chance(seed) >> 62;
    uint64_t any = chance(seed);
    uint64_t near = (any >> 8) % 5 - 2;
    if (kind == 0) {
        return low;
    }
    if (kind == 1) {
        return low + size - 1;
    }
    if (kind == 2 && (size == 0 || near - low < size)) {
        return near;
    }
    return low + (size == 0 ? any : any % size);
}

void put_word(uint64_t word)
{
    int8_t shift = 60;
    while (shift > 0 && word >> shift == 0) {
        shift = (int8_t)(shift - 4);
    }
    for (; shift >= 0; shift = (int8_t)(shift - 4)) {
        put("0123456789abcdef"[(word >> shift) & 15]);
    }
}

#if defined(__AVR__)
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

void put(char c)
{
    while (!(UCSR0A & (1 << UDRE0))) {
    }
    UDR0 = (uint8_t)c;
}

int main(void)
{
    UCSR0A = 1 << U2X0;
    UBRR0 = 0;
    UCSR0B = 1 << TXEN0;
    walk_all();
    cli();
    sleep_mode();
    return 0;
}
#elif defined(__wasm__)
void *memcpy(void *to, const void *from, unsigned long size);
void *memset(void *to, int byte, unsigned long size);

void *memcpy(void *to, const void *from, unsigned long size)
{
    char *volatile target = to;
    const char *source = from;
    unsigned long i;
    for (i = 0; i < size; i++) {
        target[i] = source[i];
    }
    return to;
}

void *memset(void *to, int byte, unsigned long size)
{
    char *volatile target = to;
    unsigned long i;
    for (i = 0; i < size; i++) {
        target[i] = (char)byte;
    }
    return to;
}
#else
#include <stdio.h>

void put(char c)
{
    putchar(c);
}

int main(void)
{
    walk_all();
    return fflush(stdout) == 0 ? 0 : 1;
}
#endif
