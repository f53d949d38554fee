/* The part of libdhd that the driver calls, on a handle that a test moves. It starts in the wall. */

#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <time.h>

#include "fake_log.h"

enum { NOTHING, READ_ONCE, READ_EVER, WRITE_ONCE, NOT_A_NUMBER, FAR, SLOW };

static double place[3], force[3];
static int count = 1, opened = -1, enabled, reads, writes, fault, at, watchdog;

void fake_devices(int devices) { count = devices; }
void fake_reset(int kind, int number)
{
    count = 1;
    opened = -1;
    enabled = reads = writes = 0;
    fault = kind;
    at = number;
    place[0] = -0.4e-3;
    place[1] = 0.7e-3;
    place[2] = -1e-3;
    force[0] = force[1] = force[2] = 0.0;
}
void fake_place(double x, double y, double z) { place[0] = x; place[1] = y; place[2] = z; }
double fake_force(int axis) { return force[axis]; }
int fake_state(int which)
{
    return which == 0 ? opened : which == 1 ? enabled : which == 2 ? reads : watchdog;
}

int dhdGetDeviceCount(void) { return count; }
int dhdOpenID(char id) { return id < count ? (opened = id) : -1; }
int dhdEnableForce(unsigned char on, char id) { enabled = on; return id == opened ? 0 : -1; }
int dhdSetWatchdog(unsigned char duration, char id)
{
    watchdog = duration;
    return id == opened ? 0 : -1;
}
int dhdClose(char id)
{
    fake_log()->closed++;
    if (id == opened)
        opened = -1;
    return 0;
}
const char *dhdErrorGetLastStr(void) { return "communication error"; }

int dhdGetPosition(double *x, double *y, double *z, char id)
{
    const int number = reads++, now = number == at;
    const struct timespec frozen = {0, 120000000};

    if (id != opened || (fault == READ_ONCE && now) || (fault == READ_EVER && number >= at))
        return -1;
    if (fault == SLOW && now)
        nanosleep(&frozen, 0);
    *x = place[0];
    *y = place[1];
    *z = fault == NOT_A_NUMBER && now ? NAN : fault == FAR && now ? 1e6 : place[2];
    return 1; /* asked for too soon: no error */
}

int dhdSetForce(double x, double y, double z, char id)
{
    if (id != opened || (fault == WRITE_ONCE && writes++ == at))
        return -1;
    fake_log_wait();
    force[0] = x;
    force[1] = y;
    force[2] = z;
    fake_log_force(x, y, z);
    return 2; /* a motor is saturated: no error */
}
