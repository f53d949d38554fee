/* A device of one's own that fails as it is told, on a handle that stands still. */

#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <time.h>

#include "fake_log.h"

enum { NOTHING, READ_ONCE, READ_EVER, WRITE_ONCE, NOT_A_NUMBER, FAR, SLOW };

static double force[3];
static int fault, at, reads, writes, opened;

void fake_reset(int kind, int number)
{
    fault = kind;
    at = number;
    reads = writes = opened = 0;
    force[0] = force[1] = force[2] = 0.0;
}
double fake_force(int axis) { return force[axis]; }

int asperity_open(void)
{
    fake_log();
    return opened++;
}
int asperity_close(void)
{
    fake_log()->closed++;
    return opened = 0;
}

int asperity_read(double position[3])
{
    const int number = reads++;
    const struct timespec frozen = {0, 120000000};

    if ((fault == READ_ONCE && number == at) || (fault == READ_EVER && number >= at))
        return 17;
    if (fault == SLOW && number == at)
        nanosleep(&frozen, 0);
    position[0] = 0.7e-3;
    position[1] = 0.4e-3;
    position[2] = -1e-3;
    if (number == at && (fault == NOT_A_NUMBER || fault == FAR))
        position[2] = fault == FAR ? 1e6 : NAN;
    return 0;
}

int asperity_write(const double commanded[3], int contact)
{
    (void)contact;
    if (fault == WRITE_ONCE && writes++ == at)
        return 18;
    fake_log_wait();
    for (int i = 0; i < 3; i++)
        force[i] = commanded[i];
    fake_log_force(force[0], force[1], force[2]);
    return 0;
}
