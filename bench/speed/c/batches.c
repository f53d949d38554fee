/* Batches of forces written for vector registers by hand, as wide as the processor's: eight points at
   a time with AVX-512, else four. NAME_force(points, n, texture, k, force) as in reference.c; n is a
   multiple of eight. Built with gcc -std=gnu11 -O3 -march=native -fno-math-errno -shared -fPIC (gnu11:
   it may fuse products and sums). */
#include <string.h>
#ifdef __AVX__
#include <immintrin.h>
#endif

#include "textures.h"

#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4
#endif
typedef double vec __attribute__((vector_size(8 * LANES)));
typedef double four __attribute__((vector_size(32)));
typedef long mask __attribute__((vector_size(8 * LANES)));

static inline vec all(double x)
{
    return (vec){0.0} + x;
}

static inline vec load(const double *p)
{
    vec v;
    memcpy(&v, p, sizeof v);
    return v;
}

static inline void store(double *p, vec v)
{
    memcpy(p, &v, sizeof v);
}

static inline vec choose(mask where, vec a, vec b)
{
    return (vec)((where & (mask)a) | (~where & (mask)b));
}

/* Integers up to 2^51 from numbers without a fraction; AVX2 has no instruction for it. */
static inline mask whole(vec x)
{
    return (mask)(x + 0x1.8p52) & 0x7ffffffffffff;
}

static inline vec root(vec x)
{
#if defined __AVX512F__
    return (vec)_mm512_sqrt_pd((__m512d)x);
#elif defined __AVX__
    return (vec)_mm256_sqrt_pd((__m256d)x);
#else
    for (int i = 0; i < LANES; i++)
        x[i] = sqrt(x[i]);
    return x;
#endif
}

static inline vec down(vec x)
{
#if defined __AVX512F__
    return (vec)_mm512_roundscale_pd((__m512d)x, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
#elif defined __AVX__
    return (vec)_mm256_floor_pd((__m256d)x);
#else
    const vec cut = __builtin_convertvector(__builtin_convertvector(x, mask), vec);
    return cut - choose(cut > x, all(1.0), all(0.0));
#endif
}

struct point {
    vec x, y, z;
};

/* Rows of three: to three vectors, and back. */
#if LANES == 8
static inline struct point rows(const double *p)
{
    const vec a = load(p), b = load(p + 8), c = load(p + 16);
    const vec x = __builtin_shuffle(a, b, (mask){0, 3, 6, 9, 12, 15, 0, 0});
    const vec y = __builtin_shuffle(a, b, (mask){1, 4, 7, 10, 13, 0, 0, 0});
    const vec z = __builtin_shuffle(a, b, (mask){2, 5, 8, 11, 14, 0, 0, 0});
    return (struct point){
        .x = __builtin_shuffle(x, c, (mask){0, 1, 2, 3, 4, 5, 10, 13}),
        .y = __builtin_shuffle(y, c, (mask){0, 1, 2, 3, 4, 8, 11, 14}),
        .z = __builtin_shuffle(z, c, (mask){0, 1, 2, 3, 4, 9, 12, 15}),
    };
}

static inline void store_rows(double *p, vec x, vec y, vec z)
{
    const vec a = __builtin_shuffle(x, y, (mask){0, 8, 0, 1, 9, 0, 2, 10});
    const vec b = __builtin_shuffle(x, y, (mask){0, 3, 11, 0, 4, 12, 0, 5});
    const vec c = __builtin_shuffle(x, y, (mask){13, 0, 6, 14, 0, 7, 15, 0});
    store(p, __builtin_shuffle(a, z, (mask){0, 1, 8, 3, 4, 9, 6, 7}));
    store(p + 8, __builtin_shuffle(b, z, (mask){10, 1, 2, 11, 4, 5, 12, 7}));
    store(p + 16, __builtin_shuffle(c, z, (mask){0, 13, 2, 3, 14, 5, 6, 15}));
}

#else
static inline struct point rows(const double *p)
{
    const vec a = load(p), b = load(p + 4), c = load(p + 8);
    return (struct point){
        .x = __builtin_shuffle(__builtin_shuffle(a, b, (mask){0, 3, 6, 0}), c, (mask){0, 1, 2, 5}),
        .y = __builtin_shuffle(__builtin_shuffle(a, b, (mask){1, 4, 7, 0}), c, (mask){0, 1, 2, 6}),
        .z = __builtin_shuffle(__builtin_shuffle(a, b, (mask){2, 5, 0, 0}), c, (mask){0, 1, 4, 7}),
    };
}

static inline void store_rows(double *p, vec x, vec y, vec z)
{
    store(p, __builtin_shuffle(__builtin_shuffle(x, y, (mask){0, 4, 0, 1}), z, (mask){0, 1, 4, 3}));
    store(p + 4, __builtin_shuffle(__builtin_shuffle(x, y, (mask){5, 0, 2, 6}), z, (mask){0, 5, 2, 3}));
    store(p + 8, __builtin_shuffle(__builtin_shuffle(x, y, (mask){0, 3, 7, 0}), z, (mask){6, 1, 2, 7}));
}
#endif

struct slopes {
    vec h, hx, hy;
};

static inline struct sinusoid sinusoid_known(const struct sinusoid *t)
{
    return *t;
}

/* Sine and cosine: reduction to |r| <= pi/4, Taylor's polynomials of degree 15 and 16, quadrants. */
static inline __attribute__((always_inline)) struct slopes sinusoid_at(const struct sinusoid *t, vec x, vec y)
{
    const vec angle = t->kx * x + t->ky * y + t->phase;
    const double shift = 0x1.8p52;
    const vec shifted = angle * 0x1.45f306dc9c883p-1 + shift;
    const vec n = shifted - shift;
    const vec r = ((angle - n * 0x1.921fb54p0) - n * 0x1.10b4611800000p-30) - n * 0x1.313198a2e0370p-61;
    const vec w = r * r;
    vec s = all(-1.0 / 1307674368000.0), c = all(1.0 / 20922789888000.0);
    s = s * w + 1.0 / 6227020800.0;
    s = s * w - 1.0 / 39916800.0;
    s = s * w + 1.0 / 362880.0;
    s = s * w - 1.0 / 5040.0;
    s = s * w + 1.0 / 120.0;
    s = s * w - 1.0 / 6.0;
    s = r + r * (w * s);
    c = c * w - 1.0 / 87178291200.0;
    c = c * w + 1.0 / 479001600.0;
    c = c * w - 1.0 / 3628800.0;
    c = c * w + 1.0 / 40320.0;
    c = c * w - 1.0 / 720.0;
    c = c * w + 1.0 / 24.0;
    c = 1.0 - 0.5 * w + w * w * c;
    const mask quadrant = (mask)shifted;
    const mask odd = -(quadrant & 1);
    const mask sine_sign = (quadrant & 2) << 62, cosine_sign = ((quadrant + 1) & 2) << 62;
    const vec sine = (vec)((mask)choose(odd, c, s) ^ sine_sign);
    const vec slope = t->a * (vec)((mask)choose(odd, s, c) ^ cosine_sign);
    return (struct slopes){.h = t->a * sine, .hx = t->kx * slope, .hy = t->ky * slope};
}

/* An axis, with a division that gcc would leave in the loop. */
struct axis {
    double cells, length, turns;
};

struct vec_heightmap {
    struct heightmap m;
    struct axis x, y;
};

static inline struct axis axis_of(long cells, long periodic)
{
    const double length = (periodic ? 1.0 : 2.0) * (double)cells;
    return (struct axis){.cells = (double)cells, .length = length, .turns = 1.0 / length};
}

static inline struct vec_heightmap heightmap_known(const struct heightmap *m)
{
    return (struct vec_heightmap){*m, axis_of(m->nx, m->periodic), axis_of(m->ny, m->periodic)};
}

struct vec_place {
    vec cell, t, sign;
};

static inline struct vec_place vec_locate(vec u, const struct axis *axis, long periodic)
{
    const double cells = axis->cells, length = axis->length;
    struct vec_place p = {.sign = all(1.0)};
    u -= length * down(u * axis->turns);
    if (!periodic) {
        const mask back = u > cells;
        u = choose(back, length - u, u);
        p.sign = choose(back, all(-1.0), p.sign);
    }
    const vec cell = down(u);
    p.cell = choose(cell < cells, cell, all(cells - 1.0));
    p.t = u - p.cell;
    return p;
}

static inline void vec_weights(vec t, vec w[4], vec d[4])
{
    const vec r = 1.0 - t, tt = t * t, rr = r * r;
    w[0] = rr * r * (1.0 / 6.0);
    w[1] = 2.0 / 3.0 - tt + 0.5 * tt * t;
    w[2] = 2.0 / 3.0 - rr + 0.5 * rr * r;
    w[3] = tt * t * (1.0 / 6.0);
    d[0] = -0.5 * rr;
    d[1] = t * (1.5 * t - 2.0);
    d[2] = r * (2.0 - 1.5 * r);
    d[3] = 0.5 * tt;
}

#if LANES == 8
#define PAIR(i) two_rows(c + at[i], c + at[4 + i])
#define TURN(i, j, k, l) (mask){i, j, k, l, 4 + i, 4 + j, 4 + k, 4 + l}
#define FAR 8
static inline vec two_rows(const double *a, const double *b)
{
    four low, high;
    memcpy(&low, a, sizeof low);
    memcpy(&high, b, sizeof high);
    return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}
#else
#define PAIR(i) load(c + at[i])
#define TURN(i, j, k, l) (mask){i, j, k, l}
#define FAR 4
#endif

/* Four neighbours of each point: loaded row by row and turned, faster than gathered. */
static inline void neighbours(const double *c, const long *at, vec out[4])
{
    const vec a = PAIR(0), b = PAIR(1), d = PAIR(2), e = PAIR(3);
    const vec ab = __builtin_shuffle(a, b, TURN(0, FAR, 2, FAR + 2));
    const vec ba = __builtin_shuffle(a, b, TURN(1, FAR + 1, 3, FAR + 3));
    const vec de = __builtin_shuffle(d, e, TURN(0, FAR, 2, FAR + 2));
    const vec ed = __builtin_shuffle(d, e, TURN(1, FAR + 1, 3, FAR + 3));
    out[0] = __builtin_shuffle(ab, de, TURN(0, 1, FAR, FAR + 1));
    out[1] = __builtin_shuffle(ba, ed, TURN(0, 1, FAR, FAR + 1));
    out[2] = __builtin_shuffle(ab, de, TURN(2, 3, FAR + 2, FAR + 3));
    out[3] = __builtin_shuffle(ba, ed, TURN(2, 3, FAR + 2, FAR + 3));
}

static inline __attribute__((always_inline)) struct slopes heightmap_at(const struct vec_heightmap *k, vec x, vec y)
{
    const struct heightmap *m = &k->m;
    const struct vec_place u = vec_locate((x - m->x0) * m->ix, &k->x, m->periodic);
    const struct vec_place v = vec_locate((y - m->y0) * m->iy, &k->y, m->periodic);
    const long stride = m->nx + 3;
    const mask at = whole(v.cell * (double)stride + u.cell);
    vec w[4], w1[4], g[4], g1[4], c[4];
    struct slopes s = {.h = all(0.0), .hx = all(0.0), .hy = all(0.0)};
    vec_weights(u.t, w, w1);
    vec_weights(v.t, g, g1);
    for (int i = 0; i < 4; i++) {
        neighbours(m->coefficients + i * stride, (const long *)&at, c);
        const vec row = w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3];
        const vec row1 = w1[0] * c[0] + w1[1] * c[1] + w1[2] * c[2] + w1[3] * c[3];
        s.h += g[i] * row;
        s.hx += g[i] * row1;
        s.hy += g1[i] * row;
    }
    s.hx *= u.sign * m->ix;
    s.hy *= v.sign * m->iy;
    return s;
}

#define FORCE(name, kind, DEPTH, PUSH, FX, FY)                                             \
    void name##_##kind##_force(const double *restrict p, long n, const struct kind *given, \
                               double k, double *restrict f)                               \
    {                                                                                      \
        const __auto_type texture = kind##_known(given);                                   \
        for (const double *end = p + 3 * n; p != end; p += 3 * LANES, f += 3 * LANES) {                  \
            const struct point q = rows(p);                                                \
            const struct slopes s = kind##_at(&texture, q.x, q.y);                         \
            const vec depth = DEPTH;                                                       \
            const vec push = choose(depth > 0.0, k * depth PUSH, all(0.0));                \
            store_rows(f, FX, FY, push);                                                   \
        }                                                                                  \
    }

#define NORMAL / root(1.0 + s.hx * s.hx + s.hy * s.hy)
#define LAWS_ON(kind)                                                  \
    FORCE(a, kind, s.h - q.z, , all(0.0), all(0.0))                    \
    FORCE(b, kind, s.h - q.z, NORMAL, -s.hx * push, -s.hy * push)      \
    FORCE(c, kind, s.h - q.z, , -s.hx * push, -s.hy * push)            \
    FORCE(g, kind, -q.z, NORMAL, -s.hx * push, -s.hy * push)

LAWS_ON(sinusoid)
LAWS_ON(heightmap)
