#include <stdio.h>
#define PROGMEM
#define pgm_read_byte(place) (*(place))

static void put(char letter)
{
    putchar(letter);
}

static NAME_status called(void)
{
    return CALL(&state, &inputs);
}

static void set_up(void)
{
}

static void tell_costs(void)
{
}

static int end(int code)
{
    return code;
}
