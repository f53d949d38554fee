/* Forces and Jacobians of W, A, B, C, G for the C reference, written from MATH.md sections 2, 3.
   d is the depth [m], k the stiffness [N/m], s the height and its derivatives. J is row by row. */
#ifndef ASPERITY_BENCH_LAWS_H
#define ASPERITY_BENCH_LAWS_H

#include "textures.h"

static inline void set3(double *f, double x, double y, double z)
{
    f[0] = x;
    f[1] = y;
    f[2] = z;
}

/* W and A: f = k d e_z */
static inline void upright_force(double d, double k, double *f)
{
    set3(f, 0.0, 0.0, k * d);
}

static inline void w_jacobian(double k, double *j)
{
    set3(j, 0.0, 0.0, 0.0);
    set3(j + 3, 0.0, 0.0, 0.0);
    set3(j + 6, 0.0, 0.0, -k);
}

/* A: J = -k e_z w^T */
static inline void a_jacobian(const struct jet *s, double k, double *j)
{
    set3(j, 0.0, 0.0, 0.0);
    set3(j + 3, 0.0, 0.0, 0.0);
    set3(j + 6, k * s->hx, k * s->hy, -k);
}

/* B and G: f = k d n */
static inline void normal_force(const struct jet *s, double d, double k, double *f)
{
    const double push = k * d / sqrt(1.0 + s->hx * s->hx + s->hy * s->hy);
    set3(f, -s->hx * push, -s->hy * push, push);
}

/* k d N E^T, with N = [n_x n_y] and n_x = w_x/|w| - w (w . w_x)/|w|^3 */
struct turning {
    double xx, xy, yx, yy, zx, zy, inverse;
};

static inline struct turning turn(const struct jet *s, double d, double k)
{
    const double i2 = 1.0 / (1.0 + s->hx * s->hx + s->hy * s->hy);
    const double i1 = sqrt(i2), kd = k * d * i1;
    const double zx = -i2 * (s->hx * s->hxx + s->hy * s->hxy);
    const double zy = -i2 * (s->hx * s->hxy + s->hy * s->hyy);
    return (struct turning){
        .xx = -kd * (s->hxx + s->hx * zx),
        .xy = -kd * (s->hxy + s->hx * zy),
        .yx = -kd * (s->hxy + s->hy * zx),
        .yy = -kd * (s->hyy + s->hy * zy),
        .zx = kd * zx,
        .zy = kd * zy,
        .inverse = i1,
    };
}

/* B: f = k d n, J = -k w w^T/|w| + k d N E^T */
static inline void b_both(const struct jet *s, double d, double k, double *f, double *j)
{
    const struct turning n = turn(s, d, k);
    const double q = k * n.inverse, qx = q * s->hx, qy = q * s->hy;
    set3(f, -d * qx, -d * qy, d * q);
    set3(j, n.xx - qx * s->hx, n.xy - qx * s->hy, qx);
    set3(j + 3, n.yx - qy * s->hx, n.yy - qy * s->hy, qy);
    set3(j + 6, n.zx + qx, n.zy + qy, -q);
}

/* G: f = k d n, J = -k n e_z^T + k d N E^T */
static inline void g_both(const struct jet *s, double d, double k, double *f, double *j)
{
    const struct turning n = turn(s, d, k);
    const double q = k * n.inverse, qx = q * s->hx, qy = q * s->hy;
    set3(f, -d * qx, -d * qy, d * q);
    set3(j, n.xx, n.xy, qx);
    set3(j + 3, n.yx, n.yy, qy);
    set3(j + 6, n.zx, n.zy, -q);
}

/* C: f = k d w, J = -k (w w^T + d diag(H, 0)) */
static inline void c_force(const struct jet *s, double d, double k, double *f)
{
    const double kd = k * d;
    set3(f, -s->hx * kd, -s->hy * kd, kd);
}

static inline void c_both(const struct jet *s, double d, double k, double *f, double *j)
{
    const double kx = k * s->hx, ky = k * s->hy, kd = k * d;
    const double xy = -(kx * s->hy + kd * s->hxy);
    set3(f, -d * kx, -d * ky, kd);
    set3(j, -(kx * s->hx + kd * s->hxx), xy, kx);
    set3(j + 3, xy, -(ky * s->hy + kd * s->hyy), ky);
    set3(j + 6, kx, ky, -k);
}

#endif
