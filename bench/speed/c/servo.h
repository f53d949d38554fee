/* A servo loop with an honest energy ledger around a law, for the C reference: measured position,
   force, virtual damping, limit, rounding, delay, held force, sums. Written from the description in
   docs/theory/simulation.md. LAW(x, y, z) is the force along z (W and A push along z only). */
#ifndef ASPERITY_BENCH_SERVO_H
#define ASPERITY_BENCH_SERVO_H

#include "textures.h"

struct servo {
    double position_step, force_step, max_force, damper, share, period;
};

/* What is kept between calls. Sums: supplied (3), same sample (3), lost, hand, friction, sampling,
   exchanged. */
struct loop {
    double x[6], measured[3], filtered[3], commanded[3], sums[11];
    long begun, head, done;
};

static inline double rounded(double value, double step)
{
    return step > 0.0 ? step * floor(value / step + 0.5) : value;
}

/* Round to multiples of a step; towards zero where the length would exceed its limit. */
static inline void limited(double c[3], double step, double largest)
{
    if (!(step > 0.0))
        return;
    double r[3], square = 0.0;
    for (int i = 0; i < 3; i++) {
        r[i] = rounded(c[i], step);
        square += r[i] * r[i];
    }
    const int fits = square <= largest * (1.0 + 1e-12);
    for (int i = 0; i < 3; i++)
        c[i] = fits ? r[i] : copysign(step * floor(fabs(c[i]) / step), c[i]);
}

static inline void flush(double *values, int count)
{
    for (int i = 0; i < count; i++)
        if (fabs(values[i]) < 1e-60)
            values[i] = 0.0;
}

/* One sample before the body moves: from the position to the force that is held. */
static inline void command(struct loop *s, const struct servo *set, double *restrict queue,
                           long slots, double rate, const double m[3], double c[3],
                           double f[3])
{
    double step[3], square = 0.0;
    for (int i = 0; i < 3; i++)
        step[i] = m[i] - s->measured[i];
    if (set->damper != 0.0)
        for (int i = 0; i < 3; i++) {
            s->filtered[i] += set->share * (step[i] * rate - s->filtered[i]);
            c[i] -= set->damper * s->filtered[i];
        }
    for (int i = 0; i < 3; i++)
        square += c[i] * c[i];
    if (square > set->max_force * set->max_force) {
        const double shorter = set->max_force / sqrt(square);
        for (int i = 0; i < 3; i++)
            c[i] *= shorter;
    }
    limited(c, set->force_step, set->max_force * set->max_force);
    double sampling = 0.0;
    for (int i = 0; i < 3; i++) {
        s->sums[3 + i] += c[i] * step[i];
        sampling += (s->commanded[i] - c[i]) * step[i];
        s->commanded[i] = c[i];
        s->measured[i] = m[i];
        queue[3 * s->head + i] = c[i];
    }
    s->sums[9] += 0.5 * sampling;
    if (++s->head == slots)
        s->head = 0;
    for (int i = 0; i < 3; i++)
        f[i] = queue[3 * s->head + i];
}

static inline int wild(const double x[6])
{
    double size = 0.0;
    for (int i = 0; i < 6; i++)
        size += fabs(x[i]);
    return !(size < 1e6);
}

/* The loop; INSIDE says whether the measured position m is in the body, MOVE moves s->x by one
   sample under force f with the anchor at a and velocity u, and returns whether that worked. */
#define SERVO_LOOP(PUSH, INSIDE, MOVE)                                                         \
    if (!s->begun) {                                                                           \
        s->begun = 1;                                                                          \
        for (int i = 0; i < 3; i++)                                                            \
            s->measured[i] = rounded(s->x[i], set->position_step);                             \
    }                                                                                          \
    const double rate = 1.0 / set->period;                                                     \
    for (long k = 0; k < samples; k++, anchor += 3) {                                          \
        if ((k & 255) == 0) {                                                                  \
            flush(s->x, 6);                                                                    \
            flush(s->filtered, 3);                                                             \
        }                                                                                      \
        double m[3], c[3] = {0.0, 0.0, 0.0}, f[3], a[3], u[3];                                 \
        for (int i = 0; i < 3; i++)                                                            \
            m[i] = rounded(s->x[i], set->position_step);                                       \
        PUSH;                                                                                  \
        command(s, set, queue, slots, rate, m, c, f);                                                \
        for (int i = 0; i < 3; i++) {                                                          \
            a[i] = anchor[i];                                                                  \
            u[i] = (anchor[3 + i] - a[i]) * rate;                                              \
        }                                                                                      \
        const int inside = INSIDE;                                                             \
        (void)inside;                                                                          \
        if (!MOVE)                                                                             \
            return k;                                                                          \
        s->done++;                                                                             \
        if (wild(s->x))                                                                        \
            return k + 1;                                                                      \
    }                                                                                          \
    return samples;

#endif
