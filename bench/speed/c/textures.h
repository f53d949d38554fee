/* Height functions for the C reference, written from MATH.md section 1. */
#ifndef ASPERITY_BENCH_TEXTURES_H
#define ASPERITY_BENCH_TEXTURES_H

#include <math.h>

/* Height [m], slopes [1], second derivatives [1/m]. */
struct jet {
    double h, hx, hy, hxx, hxy, hyy;
};

/* h = a sin(kx x + ky y + phase) */
struct sinusoid {
    double a, kx, ky, phase;
};

/* Bicubic B-spline: (ny + 3) x (nx + 3) coefficients of nx x ny cells, one row and column before
   the first cell; ix, iy nodes per metre; repeated, or mirrored at the border. */
struct heightmap {
    const double *coefficients;
    long nx, ny;
    double ix, iy, x0, y0;
    long periodic;
};

static inline double sinusoid_height(const struct sinusoid *t, double x, double y)
{
    return t->a * sin(t->kx * x + t->ky * y + t->phase);
}

static inline struct jet sinusoid_slope(const struct sinusoid *t, double x, double y)
{
    const double angle = t->kx * x + t->ky * y + t->phase;
    const double c = t->a * cos(angle); /* gcc makes one sincos of the two */
    return (struct jet){.h = t->a * sin(angle), .hx = t->kx * c, .hy = t->ky * c};
}

static inline struct jet sinusoid_curvature(const struct sinusoid *t, double x, double y)
{
    struct jet s = sinusoid_slope(t, x, y);
    s.hxx = -t->kx * t->kx * s.h;
    s.hxy = -t->kx * t->ky * s.h;
    s.hyy = -t->ky * t->ky * s.h;
    return s;
}

/* A coordinate in cells: which cell, where in it, and the sign of the mirrored derivative. */
struct place {
    long cell;
    double t, sign;
};

static inline struct place locate(double u, long cells, long periodic)
{
    struct place p = {.sign = 1.0};
    if (u < 0.0 || u > (double)cells) {
        const double length = (periodic ? 1.0 : 2.0) * (double)cells;
        u -= length * floor(u / length);
        if (u > (double)cells) {
            u = length - u;
            p.sign = -1.0;
        }
    }
    p.cell = (long)u;
    if (p.cell >= cells)
        p.cell = cells - 1;
    p.t = u - (double)p.cell;
    return p;
}

static inline void weights(double t, double w[4])
{
    const double r = 1.0 - t, tt = t * t, rr = r * r;
    w[0] = rr * r * (1.0 / 6.0);
    w[1] = 2.0 / 3.0 - tt + 0.5 * tt * t;
    w[2] = 2.0 / 3.0 - rr + 0.5 * rr * r;
    w[3] = tt * t * (1.0 / 6.0);
}

static inline void weights_first(double t, double w[4])
{
    const double r = 1.0 - t;
    w[0] = -0.5 * r * r;
    w[1] = t * (1.5 * t - 2.0);
    w[2] = r * (2.0 - 1.5 * r);
    w[3] = 0.5 * t * t;
}

static inline void weights_second(double t, double w[4])
{
    w[0] = 1.0 - t;
    w[1] = 3.0 * t - 2.0;
    w[2] = 1.0 - 3.0 * t;
    w[3] = t;
}

static inline double dot4(const double *v, const double w[4])
{
    return w[0] * v[0] + w[1] * v[1] + w[2] * v[2] + w[3] * v[3];
}

static inline double heightmap_height(const struct heightmap *m, double x, double y)
{
    const struct place u = locate((x - m->x0) * m->ix, m->nx, m->periodic);
    const struct place v = locate((y - m->y0) * m->iy, m->ny, m->periodic);
    const long stride = m->nx + 3;
    const double *c = m->coefficients + v.cell * stride + u.cell;
    double w[4], row[4], g[4];
    weights(u.t, w);
    weights(v.t, g);
    for (int i = 0; i < 4; i++)
        row[i] = dot4(c + i * stride, w);
    return dot4(row, g);
}

static inline struct jet heightmap_slope(const struct heightmap *m, double x, double y)
{
    const struct place u = locate((x - m->x0) * m->ix, m->nx, m->periodic);
    const struct place v = locate((y - m->y0) * m->iy, m->ny, m->periodic);
    const long stride = m->nx + 3;
    const double *c = m->coefficients + v.cell * stride + u.cell;
    double w[4], w1[4], g[4], g1[4], row[4], row1[4];
    weights(u.t, w);
    weights_first(u.t, w1);
    weights(v.t, g);
    weights_first(v.t, g1);
    for (int i = 0; i < 4; i++) {
        row[i] = dot4(c + i * stride, w);
        row1[i] = dot4(c + i * stride, w1);
    }
    return (struct jet){
        .h = dot4(row, g),
        .hx = u.sign * m->ix * dot4(row1, g),
        .hy = v.sign * m->iy * dot4(row, g1),
    };
}

static inline struct jet heightmap_curvature(const struct heightmap *m, double x, double y)
{
    const struct place u = locate((x - m->x0) * m->ix, m->nx, m->periodic);
    const struct place v = locate((y - m->y0) * m->iy, m->ny, m->periodic);
    const long stride = m->nx + 3;
    const double *c = m->coefficients + v.cell * stride + u.cell;
    const double sx = u.sign * m->ix, sy = v.sign * m->iy;
    double w[4], w1[4], w2[4], g[4], g1[4], g2[4], row[4], row1[4], row2[4];
    weights(u.t, w);
    weights_first(u.t, w1);
    weights_second(u.t, w2);
    weights(v.t, g);
    weights_first(v.t, g1);
    weights_second(v.t, g2);
    for (int i = 0; i < 4; i++) {
        row[i] = dot4(c + i * stride, w);
        row1[i] = dot4(c + i * stride, w1);
        row2[i] = dot4(c + i * stride, w2);
    }
    return (struct jet){
        .h = dot4(row, g),
        .hx = sx * dot4(row1, g),
        .hy = sy * dot4(row, g1),
        .hxx = m->ix * m->ix * dot4(row2, g),
        .hxy = sx * sy * dot4(row1, g1),
        .hyy = m->iy * m->iy * dot4(row, g2),
    };
}

#endif
