/* The loops that the benchmark measures against: force, and force with Jacobian, at n probe
   points. NAME_force(points, n, texture, k, force), NAME_jacobian(..., force, jacobian), NAME a
   law and a texture, for instance b_sinusoid. Built with gcc -O3 -shared -fPIC. */
#include "laws.h"

#define POINT const double x = p[0], y = p[1], z = p[2]

static inline void no_contact(double *restrict f, double *restrict j)
{
    set3(f, 0.0, 0.0, 0.0);
    if (j)
        for (int i = 0; i < 9; i++)
            j[i] = 0.0;
}

/* CONTACT declares the depth d (and the jet s where the law needs it), ACT writes f and j. The
   texture is copied, so that its fields may live in registers. */
#define FORCE(name, kind, CONTACT, ACT)                                                        \
    void name##_##kind##_force(const double *restrict p, long n, const struct kind *texture,   \
                               double k, double *restrict f)                                   \
    {                                                                                          \
        const struct kind t = *texture;                                                        \
        (void)t;                                                                               \
        for (const double *end = p + 3 * n; p != end; p += 3, f += 3) {                        \
            POINT;                                                                             \
            (void)x, (void)y;                                                                  \
            CONTACT;                                                                           \
            if (!(d > 0.0)) {                                                                  \
                no_contact(f, 0);                                                              \
                continue;                                                                      \
            }                                                                                  \
            ACT;                                                                               \
        }                                                                                      \
    }

#define JACOBIAN(name, kind, CONTACT, ACT)                                                     \
    void name##_##kind##_jacobian(const double *restrict p, long n, const struct kind *texture,\
                                  double k, double *restrict f, double *restrict j)            \
    {                                                                                          \
        const struct kind t = *texture;                                                        \
        (void)t;                                                                               \
        for (const double *end = p + 3 * n; p != end; p += 3, f += 3, j += 9) {                \
            POINT;                                                                             \
            (void)x, (void)y;                                                                  \
            CONTACT;                                                                           \
            if (!(d > 0.0)) {                                                                  \
                no_contact(f, j);                                                              \
                continue;                                                                      \
            }                                                                                  \
            ACT;                                                                               \
        }                                                                                      \
    }

#define NOMINAL const double d = -z
#define BELOW(kind) const double d = kind##_height(&t, x, y) - z
#define BELOW_SLOPE(kind)                           \
    const struct jet s = kind##_slope(&t, x, y);    \
    const double d = s.h - z
#define BELOW_CURVATURE(kind)                        \
    const struct jet s = kind##_curvature(&t, x, y); \
    const double d = s.h - z

#define LAWS_ON(kind)                                                                          \
    FORCE(w, kind, NOMINAL, upright_force(d, k, f))                                            \
    JACOBIAN(w, kind, NOMINAL, upright_force(d, k, f); w_jacobian(k, j))                       \
    FORCE(a, kind, BELOW(kind), upright_force(d, k, f))                                        \
    JACOBIAN(a, kind, BELOW_SLOPE(kind), upright_force(d, k, f); a_jacobian(&s, k, j))         \
    FORCE(b, kind, BELOW_SLOPE(kind), normal_force(&s, d, k, f))                               \
    JACOBIAN(b, kind, BELOW_CURVATURE(kind), b_both(&s, d, k, f, j))                           \
    FORCE(c, kind, BELOW_SLOPE(kind), c_force(&s, d, k, f))                                    \
    JACOBIAN(c, kind, BELOW_CURVATURE(kind), c_both(&s, d, k, f, j))                           \
    FORCE(g, kind, NOMINAL, const struct jet s = kind##_slope(&t, x, y);                       \
          normal_force(&s, d, k, f))                                                           \
    JACOBIAN(g, kind, NOMINAL, const struct jet s = kind##_curvature(&t, x, y);                \
             g_both(&s, d, k, f, j))

LAWS_ON(sinusoid)
LAWS_ON(heightmap)
