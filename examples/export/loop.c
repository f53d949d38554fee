/*
 * A servo loop in C: a hand pulls a handle over an exported surface, 4000 times a second.
 *
 *     asperity export sinusoid:amplitude=0.1mm,period=2mm --law C --stiffness 800N/m -o texture.h
 *     cc -std=c99 -O2 loop.c -lm -o loop && ./loop
 *
 * With a device, `read_position` and `send_force` are its driver's; here they are a simulated
 * handle of 60 g, damped by 2 N s/m, that is pressed down by 0.15 N and pulled along x by 0.07 N.
 */
#include <stdio.h>

#include "texture.h"

#define RATE 4000.0 /* [Hz] */
#define MOST_FORCE 5.0 /* of the device [N] */

static double at[3] = {0.0, 0.0, 0.0005}; /* of the handle [m] */
static double moving[3];                  /* [m/s] */

static void read_position(double position[3])
{
    for (int i = 0; i < 3; i++) {
        position[i] = at[i];
    }
}

static void send_force(const double force[3])
{
    const double mass = 0.06, damping = 2.0, period = 1.0 / RATE, pull[3] = {0.07, 0.0, -0.15};
    for (int i = 0; i < 3; i++) {
        moving[i] += period * (force[i] + pull[i] - damping * moving[i]) / mass;
        at[i] += period * moving[i];
    }
}

/* A force that is too long for the device is shortened, not turned. */
static void limit(double force[3])
{
    const double length =
        sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
    for (int i = 0; i < 3; i++) {
        force[i] *= length > MOST_FORCE ? MOST_FORCE / length : 1.0;
    }
}

int main(int count, char **words)
{
    texture_state state;
    double position[3], force[3];
    if (texture_abi_version() != TEXTURE_ABI) { /* of a library; a header has its own number */
        fprintf(stderr, "the library has ABI %d, this program ABI %d\n", texture_abi_version(),
                TEXTURE_ABI);
        return 1;
    }
#if defined(TEXTURE_LOADED) /* exported with --load */
    if (texture_load(count > 1 ? words[1] : "texture.field") != TEXTURE_LOADED) {
        fprintf(stderr, "the field cannot be loaded\n");
        return 1;
    }
#else
    (void)count;
    (void)words;
#endif
    texture_prepare();
    texture_reset(&state);
    printf("k = %g N/m, q <= %g, content %.12s\n", TEXTURE_STIFFNESS, TEXTURE_Q_UPPER,
           TEXTURE_CONTENT);
    for (int tick = 0; tick < 8000; tick++) {
        read_position(position);
        texture_force(&state, position, force);
        limit(force);
        send_force(force);
        if (tick % 1000 == 999) {
            printf("%5.2f s  x = %6.3f mm  z = %7.4f mm  f = (%7.4f, %7.4f) N\n",
                   (tick + 1) / RATE, 1e3 * position[0], 1e3 * position[2], force[0], force[2]);
        }
    }
    return 0;
}
