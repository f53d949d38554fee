/* Renderers with faults, for the tests of certification. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct {
    double last[3];
    int has_last;
} memory;

#define RESET(name) \
    void name##_reset(void *state) { memset(state, 0, sizeof(memory)); }

RESET(spring)
RESET(crash)
RESET(hang)
RESET(nan)
RESET(step)
RESET(ramp)
RESET(curl)
RESET(tick)
RESET(big)

static void wall(const double *p, double *f)
{
    f[0] = f[1] = 0.0;
    f[2] = p[2] < 0.0 ? -1000.0 * p[2] : 0.0;
}

void spring_force(void *state, const double *p, double *f) { wall(p, f); }

void crash_force(void *state, const double *p, double *f)
{
    wall(p, f);
    if (p[2] < -0.5e-3)
        abort();
}

void hang_force(void *state, const double *p, double *f)
{
    wall(p, f);
    while (p[2] < -0.5e-3)
        usleep(1000);
}

void nan_force(void *state, const double *p, double *f)
{
    wall(p, f);
    if (fabs(p[0] - 2e-4) < 5e-5 && fabs(p[2] + 3e-4) < 5e-5)
        f[0] = NAN;
}

void step_force(void *state, const double *p, double *f)
{
    wall(p, f);
    if (p[2] < 0.0 && p[0] > 1.2345e-4)
        f[2] += 1e-3;
}

void ramp_force(void *state, const double *p, double *f)
{
    double share = (p[0] - 1.2345e-4) / 1e-6;
    wall(p, f);
    f[2] += share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
}

void curl_force(void *state, const double *p, double *f)
{
    wall(p, f);
    f[0] += 0.01 * f[2] * sin(6283.185307179586 * p[0]);
}

void tick_force(void *state, const double *p, double *f)
{
    memory *m = state;
    wall(p, f);
    if (m->has_last)
        f[0] += 50.0 * (p[0] - m->last[0]);
    memcpy(m->last, p, sizeof m->last);
    m->has_last = 1;
}

/* With a state that the library opens, in millimetres. */
static int opened;
void *own_open(const char *text) { opened += strcmp(text, "surface") == 0; return opened ? &opened : 0; }
void own_reset(void *state) {}
void own_force(void *state, const double *p, double *f)
{
    f[0] = f[1] = 0.0;
    f[2] = p[2] < 0.0 ? -2.0 * p[2] * *(int *)state : 0.0;
}
void own_close(void *state) {}
