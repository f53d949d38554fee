/* A five-bar with uniform links over one sample, in the coordinates of its handle, by classical
   Runge-Kutta steps with loss and the hand's work integrated along. */
#ifndef ASPERITY_BENCH_SERVO_BAR_H
#define ASPERITY_BENCH_SERVO_BAR_H

#include "servo.h"

struct bar {
    double near, far, base, inertia, distal, handle, x, z, damping; /* as asperity orders them */
    double is_band, stiffness[3], held[3], press[3], length, rest;
    double rate, period, share, least;
    long fewest, inside_only;
};

/* Sums over both arms: mass matrix, what the masses need while p'' = 0, J^-T J^-1. */
struct inertia {
    double mxx, mxz, mzz, cx, cz, bxx, bxz, bzz;
};

static inline void add_arm(struct inertia *s, const struct bar *bar, double x, double z, double dx,
                           double dz, double side)
{
    const double square = x * x + z * z;
    const double along = 0.5 * (square + bar->near * bar->near - bar->far * bar->far) / square;
    const double across = side * sqrt(bar->near * bar->near / square - along * along);
    const double lx = along * x + across * z, lz = along * z - across * x;
    const double over = 1.0 / (across * square);
    const double gx = (x - lx) * over, gz = (z - lz) * over;
    const double turn = gx * dx + gz * dz, turn2 = turn * turn;
    const double wx = dx + turn * lz, wz = dz - turn * lx;
    const double gain =
        (wx * wx + wz * wz + turn2 * (along * square - bar->near * bar->near)) * over;
    const double sixth = bar->distal * (1.0 / 6.0), i = bar->inertia;
    s->mxx += i * gx * gx + 2.0 * sixth * (1.0 - lz * gx);
    s->mxz += i * gx * gz + sixth * (lx * gx - lz * gz);
    s->mzz += i * gz * gz + 2.0 * sixth * (1.0 + lx * gz);
    s->cx += i * gain * gx - sixth * (lz * gain + turn2 * lx);
    s->cz += i * gain * gz + sixth * (lx * gain - turn2 * lz);
    s->bxx += gx * gx;
    s->bxz += gx * gz;
    s->bzz += gz * gz;
}

struct rates {
    double ax, az, lost, hand;
};

static inline struct rates bar_rates(const struct bar *bar, double x, double z, double dx,
                                     double dz, double fx, double fz, double ax, double az,
                                     double ux, double uz, double damping)
{
    struct inertia s = {.mxx = bar->handle, .mzz = bar->handle};
    add_arm(&s, bar, bar->x + x, bar->z + z, dx, dz, 1.0);
    add_arm(&s, bar, bar->x + x + bar->base, bar->z + z, dx, dz, -1.0);
    const double rx = ux - dx, rz = uz - dz, sx = ax - x;
    double sz = az - z, hx = bar->held[0] * rx, hz = bar->held[2] * rz;
    double lost = hx * rx + hz * rz;
    if (bar->is_band > 0.0) {
        sz -= bar->length;
        const double length = sqrt(sx * sx + sz * sz);
        if (length > bar->rest) {
            const double pull = bar->stiffness[0] * (length - bar->rest) / length;
            hx += pull * sx;
            hz += pull * sz;
        }
    } else {
        hx += bar->stiffness[0] * sx;
        hz += bar->stiffness[2] * sz;
    }
    const double qx = damping * (s.bxx * dx + s.bxz * dz), qz = damping * (s.bxz * dx + s.bzz * dz);
    const double px = fx + hx + bar->press[0] - qx - s.cx;
    const double pz = fz + hz + bar->press[2] - qz - s.cz;
    const double over = 1.0 / (s.mxx * s.mzz - s.mxz * s.mxz);
    lost += qx * dx + qz * dz;
    return (struct rates){
        .ax = (s.mzz * px - s.mxz * pz) * over,
        .az = (s.mxx * pz - s.mxz * px) * over,
        .lost = lost,
        .hand = ux * hx + uz * hz + bar->press[0] * dx + bar->press[2] * dz,
    };
}

static inline int reached(const struct bar *bar, double x, double z)
{
    const double px = bar->x + x, pz = bar->z + z;
    const double sides = bar->near * bar->near + bar->far * bar->far;
    const double limit = 2.0 * bar->near * bar->far * sqrt(1.0 - bar->least * bar->least);
    return pz > 0.0 && fabs(sides - px * px - pz * pz) < limit
           && fabs(sides - (px + bar->base) * (px + bar->base) - pz * pz) < limit;
}

static inline int turns(const struct bar *bar, double sx, double sz, double tx, double tz)
{
    if (bar->is_band == 0.0)
        return 0;
    sz -= bar->length;
    tz -= bar->length;
    const double rest = bar->rest * bar->rest;
    return (sx * sx + sz * sz > rest) != (tx * tx + tz * tz > rest);
}

static inline int move_bar(struct loop *s, const struct bar *bar, const double f[3],
                           const double a[3], const double u[3], int inside)
{
    const double damping = inside || !bar->inside_only ? bar->damping : 0.0;
    double px = s->x[0], pz = s->x[2], vx = s->x[3], vz = s->x[5];
    double wx = 0.0, wz = 0.0, lost = 0.0, hand = 0.0, time = 0.0;
    const double speed = sqrt(vx * vx + vz * vz);
    const long needed = 1 + (long)((bar->rate + 4.0 * speed / bar->near) * bar->period / bar->share);
    const long parts = needed > bar->fewest ? needed : bar->fewest;
    const double span = bar->period / (double)parts;
    double h = span;
    for (long part = 0, fine = 0; part < parts;) {
        const double half = 0.5 * h, sixth = h * (1.0 / 6.0);
        const double ax = a[0] + time * u[0], az = a[2] + time * u[2];
        const struct rates r1 = bar_rates(bar, px, pz, vx, vz, f[0], f[2], ax, az, u[0], u[2],
                                          damping);
        const double vx2 = vx + half * r1.ax, vz2 = vz + half * r1.az;
        const double mx = ax + half * u[0], mz = az + half * u[2];
        const struct rates r2 = bar_rates(bar, px + half * vx, pz + half * vz, vx2, vz2, f[0], f[2],
                                          mx, mz, u[0], u[2], damping);
        const double vx3 = vx + half * r2.ax, vz3 = vz + half * r2.az;
        const struct rates r3 = bar_rates(bar, px + half * vx2, pz + half * vz2, vx3, vz3, f[0],
                                          f[2], mx, mz, u[0], u[2], damping);
        const double vx4 = vx + h * r3.ax, vz4 = vz + h * r3.az;
        const double ex = ax + h * u[0], ez = az + h * u[2];
        const struct rates r4 = bar_rates(bar, px + h * vx3, pz + h * vz3, vx4, vz4, f[0], f[2],
                                          ex, ez, u[0], u[2], damping);
        const double dx = sixth * (vx + 2.0 * (vx2 + vx3) + vx4);
        const double dz = sixth * (vz + 2.0 * (vz2 + vz3) + vz4);
        if (!reached(bar, px + dx, pz + dz))
            return 0;
        if (!fine && turns(bar, ax - px, az - pz, ex - px - dx, ez - pz - dz)) {
            fine = 256;
            h = span / 256.0;
            continue;
        }
        time += h;
        px += dx;
        pz += dz;
        vx += sixth * (r1.ax + 2.0 * (r2.ax + r3.ax) + r4.ax);
        vz += sixth * (r1.az + 2.0 * (r2.az + r3.az) + r4.az);
        wx += f[0] * dx;
        wz += f[2] * dz;
        lost += sixth * (r1.lost + 2.0 * (r2.lost + r3.lost) + r4.lost);
        hand += sixth * (r1.hand + 2.0 * (r2.hand + r3.hand) + r4.hand);
        if (fine)
            fine--;
        if (!fine) {
            part++;
            h = span;
        }
    }
    s->x[0] = px;
    s->x[2] = pz;
    s->x[3] = vx;
    s->x[5] = vz;
    s->sums[0] += wx;
    s->sums[2] += wz;
    s->sums[6] += lost;
    s->sums[7] += hand;
    s->sums[10] += fabs(wx) + fabs(wz) + fabs(lost) + fabs(hand);
    return 1;
}

#endif
