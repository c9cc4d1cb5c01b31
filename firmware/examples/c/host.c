/* On a host. */
#include <stdio.h>

#include "program.h"

void say(const char *text) { fputs(text, stdout); }
