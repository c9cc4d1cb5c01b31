/* What main.c asks of the rest: the models, and a way to say something. */
#include <stdint.h>

/* models.S: where a model begins, and where it ends. */
extern const uint8_t recursive[], recursive_end[];
extern const uint8_t tiny_bnkf[], tiny_bnkf_end[];
extern const uint8_t tiny_bnkfe[], tiny_bnkfe_end[];

/* host.c or board.c. */
void say(const char *text);
