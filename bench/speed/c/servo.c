/* The servo loops that the benchmark measures against: laws W and A on a sinusoid, on a mass in
   space (servo_w, servo_a) and on a five-bar (bar_w, bar_a). They return the samples done. */
#include "servo.h"
#include "servo_bar.h"

/* One axis of a mass, damper and spring to the anchor over one sample, exactly. */
struct axis {
    double de[3], dw[3], loss[6], b, m, spring, press, span;
};

static inline void move_axis(double *restrict p, double *restrict v, const struct axis *t, double f,
                             double a, double u, double *dp, double *lost, double *hand)
{
    const double e = *p - a, w = *v - u, push = f + t->press - t->b * u;
    const double de = t->de[0] * e + t->de[1] * w + t->de[2] * push;
    const double dw = t->dw[0] * e + t->dw[1] * w + t->dw[2] * push;
    const double d = de + u * t->span;
    *lost += e * (t->loss[0] * e + t->loss[1] * w + t->loss[2] * push)
             + w * (t->loss[3] * w + t->loss[4] * push) + t->loss[5] * push * push
             + t->b * u * (de + d);
    *hand += u * (t->m * dw - (f + t->press) * t->span + t->b * d) + t->press * d;
    *p += d;
    *v += dw;
    *dp = d;
}

static inline int move_mass(struct loop *s, const struct axis *axes, const double f[3],
                            const double a[3], const double u[3])
{
    double lost = 0.0, hand = 0.0, exchanged = 0.0;
    for (int i = 0; i < 3; i++) {
        double d;
        move_axis(&s->x[i], &s->x[3 + i], &axes[i], f[i], a[i], u[i], &d, &lost, &hand);
        s->sums[i] += f[i] * d;
        exchanged += fabs(f[i] * d);
    }
    s->sums[6] += lost;
    s->sums[7] += hand;
    s->sums[10] += exchanged + fabs(lost) + fabs(hand);
    return 1;
}

#define PUSH_W                                                                                 \
    if (-m[2] > 0.0)                                                                           \
        c[2] = -stiffness * m[2];
#define PUSH_A                                                                                 \
    const double h = sinusoid_height(&t, m[0], m[1]);                                          \
    if (h - m[2] > 0.0)                                                                        \
        c[2] = stiffness * (h - m[2]);

#define ARGUMENTS                                                                              \
    struct loop *restrict s, double *restrict queue, long slots, const double *restrict anchor,\
        long samples, const struct servo *set, const struct sinusoid *texture, double stiffness

long servo_w(ARGUMENTS, const struct axis *axes)
{
    (void)texture;
    SERVO_LOOP(PUSH_W, 0, move_mass(s, axes, f, a, u))
}

long servo_a(ARGUMENTS, const struct axis *axes)
{
    const struct sinusoid t = *texture;
    SERVO_LOOP(PUSH_A, 0, move_mass(s, axes, f, a, u))
}

long bar_w(ARGUMENTS, const struct bar *bar)
{
    (void)texture;
    SERVO_LOOP(PUSH_W, m[2] < 0.0, move_bar(s, bar, f, a, u, inside))
}

long bar_a(ARGUMENTS, const struct bar *bar)
{
    const struct sinusoid t = *texture;
    SERVO_LOOP(PUSH_A, m[2] < h, move_bar(s, bar, f, a, u, inside))
}
