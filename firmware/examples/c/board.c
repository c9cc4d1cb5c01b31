/* On a Cortex-M4F that a debugger or QEMU holds (netduinoplus2): start, and text through semihosting. */
#include "program.h"

extern uint32_t stack_top;
int main(void);
void start(void);

/* The initial stack and the first instruction, which is all that is read here. */
__attribute__((section(".start"), used)) static const struct {
    uint32_t *stack;
    void (*first)(void);
} vectors = {&stack_top, start};

static int32_t semihost(int32_t operation, const void *argument) {
    register int32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

/* SYS_OPEN of the standard output, for writing, and SYS_WRITE. */
void say(const char *text) {
    static const struct {
        const char *name;
        uint32_t mode, length;
    } console = {":tt", 4, 3};
    uint32_t length = 0;
    while (text[length]) {
        length++;
    }
    const struct {
        int32_t console;
        const char *text;
        uint32_t length;
    } written = {semihost(0x01, &console), text, length};
    semihost(0x05, &written);
}

__attribute__((noreturn, used)) static void run(void) {
    int failed = main();
    /* SYS_EXIT, with ADP_Stopped_ApplicationExit or ADP_Stopped_RunTimeErrorUnknown. */
    semihost(0x18, (const void *)(uintptr_t)(failed ? 0x20023u : 0x20026u));
    for (;;) {
    }
}

/* The floating-point unit is off after a reset; QEMU has put code and data where they belong. */
__attribute__((naked, noreturn)) void start(void) {
    __asm__ volatile("ldr r0, =0xE000ED88\n"
                     "ldr r1, =0x00F00000\n"
                     "str r1, [r0]\n"
                     "dsb\n"
                     "isb\n"
                     "b %0\n"
                     ".ltorg" ::"i"(run));
}
