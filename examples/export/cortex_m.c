/*
 * A sketch for a Cortex-M4F: the exported force in a timer's interrupt, in single precision.
 *
 *     asperity export sinusoid:amplitude=0.1mm,period=2mm --law C --precision float -o texture.h
 *     arm-none-eabi-gcc -std=c99 -Os -ffunction-sections -Wl,--gc-sections \
 *         -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 \
 *         --specs=rdimon.specs cortex_m.c -lm -o sketch.elf
 *     arm-none-eabi-size sketch.elf
 *
 * On a board `tick` is the handler of the timer, `encoders` reads its counters and `motors` writes
 * its PWM; here main() calls it and shows what the motors got.
 */
#include <stdio.h>
#include <stdlib.h>

#include "texture.h"

static texture_state state;
/* Registers of a board: counters that it changes, and what its PWM reads. */
static volatile int counts[3] = {0, 0, -5};
static volatile float commanded[3];

/* The handle: metres in the frame of the surface, from the encoders' counts. */
static void encoders(float position[3])
{
    for (int i = 0; i < 3; i++) {
        position[i] = 10e-6f * (float)counts[i];
    }
}

static void motors(const float force[3])
{
    for (int i = 0; i < 3; i++) {
        commanded[i] = force[i];
    }
}

static void tick(void)
{
    float position[3], force[3];
    encoders(position);
    texture_force(&state, position, force);
    motors(force);
}

int main(int given, char **words)
{
    const int ticks = given > 1 ? atoi(words[1]) : 8;
    texture_reset(&state);
    for (int count = 0; count < ticks; count++) {
        counts[0] = 25 * count;
        tick();
#if !defined(SILENT)
        printf("%d %d %d uN\n", (int)(1e6f * commanded[0]), (int)(1e6f * commanded[1]),
               (int)(1e6f * commanded[2]));
#endif
    }
    return 0;
}
