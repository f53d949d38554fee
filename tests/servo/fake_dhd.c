/* The part of libdhd that the driver calls, on a handle that a test moves. */

static double place[3], force[3];
static int count = 1, opened = -1, enabled, reads, writes, fails_read = -1, fails_write = -1;
static int largest_was_set;

void fake_reset(int devices, int read_that_fails, int write_that_fails)
{
    count = devices;
    opened = -1;
    enabled = reads = writes = largest_was_set = 0;
    fails_read = read_that_fails;
    fails_write = write_that_fails;
    place[0] = place[1] = place[2] = force[0] = force[1] = force[2] = 0.0;
}
void fake_place(double x, double y, double z) { place[0] = x; place[1] = y; place[2] = z; }
double fake_force(int axis) { return force[axis]; }
int fake_state(int which) { return which == 0 ? opened : which == 1 ? enabled : reads; }

int dhdGetDeviceCount(void) { return count; }
int dhdOpenID(char id) { return id < count ? (opened = id) : -1; }
int dhdEnableForce(unsigned char on, char id) { enabled = on; return id == opened ? 0 : -1; }
int dhdClose(char id) { if (id == opened) opened = -1; return 0; }
const char *dhdErrorGetLastStr(void) { return "communication error"; }

int dhdGetPosition(double *x, double *y, double *z, char id)
{
    if (id != opened || reads++ == fails_read)
        return -1;
    *x = place[0];
    *y = place[1];
    *z = place[2];
    return 1; /* asked for too soon: no error */
}

int dhdSetForce(double x, double y, double z, char id)
{
    if (id != opened || writes++ == fails_write)
        return -1;
    force[0] = x;
    force[1] = y;
    force[2] = z;
    return 2; /* a motor is saturated: no error */
}
