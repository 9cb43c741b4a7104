/* What the drivers of images share: numbers by chance, and a character at a time. */
#include <stdbool.h>
#include <stdint.h>

void put(char c);
uint64_t chance(uint64_t *seed);
uint64_t pick(uint64_t *seed, uint64_t low, uint64_t size);
void put_word(uint64_t word);
void walk_all(void);
