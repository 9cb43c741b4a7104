/* A board with a simulated AVR: each line of input sets pins, and after a cycle the ports are printed.

   board ELF MCU HZ CYCLES [log]: lines are words such as D2=1 (a pin) or u=41 (a byte on the serial port, in
   hexadecimal; 8041: its frame is broken). With `log` all values that port B had since are printed. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

static int sent = -1;

static void heard(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)param;
    sent = (int)value;
}

static char values[4096];

static void driven_to(struct avr_irq_t *irq, uint32_t value, void *param)
{
    const size_t used = strlen(values);
    (void)irq;
    (void)param;
    snprintf(values + used, sizeof values - used, "%s%02x", used == 0 ? "" : ",", (unsigned)value);
}

static void awake(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr;
    (void)cycles;
}

/* So that no sleep goes on beyond the moment. */
static avr_cycle_count_t woken(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    (void)param;
    return 0;
}

static void quiet(avr_t *avr, const int level, const char *format, va_list words)
{
    (void)avr;
    if (level <= LOG_ERROR) {
        vfprintf(stderr, format, words);
    }
}

int main(int count, char **words)
{
    static elf_firmware_t firmware;
    static unsigned char driven[26], level[26];
    char line[4096];
    avr_t *avr;
    avr_cycle_count_t period, end;
    uint32_t flags = 0;
    if (count < 5) {
        return 2;
    }
    avr_global_logger_set(quiet);
    if (elf_read_firmware(words[1], &firmware) != 0 || (avr = avr_make_mcu_by_name(words[2])) == NULL) {
        return 3;
    }
    avr_init(avr);
    avr_load_firmware(avr, &firmware);
    avr->frequency = (uint32_t)atol(words[3]);
    avr->sleep = awake;
    period = (avr_cycle_count_t)atoll(words[4]);
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), heard, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), IOPORT_IRQ_REG_PORT), driven_to, NULL);
    end = period / 2;
    while (fgets(line, sizeof line, stdin) != NULL) {
        char *word;
        const char *port;
        for (word = strtok(line, " \n"); word != NULL; word = strtok(NULL, " \n")) {
            if (word[0] == 'u') {
                avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT),
                              (uint32_t)strtol(word + 2, NULL, 16));
            } else { /* held from outside, whatever the pull-up does */
                avr_ioport_external_t held;
                unsigned char *mask = &driven[word[0] - 'A'];
                unsigned char *value = &level[word[0] - 'A'];
                unsigned char bit = (unsigned char)(1 << (word[1] - '0'));
                *mask |= bit;
                *value = (unsigned char)(word[3] == '1' ? *value | bit : *value & ~bit);
                held.name = (unsigned char)word[0];
                held.mask = *mask;
                held.value = *value;
                avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(word[0]), &held);
                avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(word[0]), word[1] - '0'),
                              (uint32_t)(word[3] - '0'));
            }
        }
        avr_cycle_timer_register(avr, end - avr->cycle, woken, NULL);
        while (avr->cycle < end) {
            int state = avr_run(avr);
            if (state == cpu_Crashed) {
                return 4;
            }
            if (state == cpu_Done) { /* it sleeps, and nothing wakes it */
                break;
            }
        }
        end += period;
        for (port = "BCD"; *port != '\0'; port++) {
            avr_ioport_state_t state;
            if (avr_ioctl(avr, AVR_IOCTL_IOPORT_GETSTATE(*port), &state) == 0) {
                printf("%c=%02x/%02x ", *port, (unsigned)state.port, (unsigned)state.ddr);
            }
        }
        if (count > 5) {
            printf("all=%s ", values);
            values[0] = '\0';
        }
        printf("u=%d\n", sent);
        sent = -1;
    }
    return 0;
}
