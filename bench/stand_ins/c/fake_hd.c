/* The part of libHD that the driver calls: a scheduler, a thread that calls back 1000 times a second
 * and in which alone frames are allowed, on a handle that a test moves. */

#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <pthread.h>
#include <string.h>
#include <time.h>

#include "fake_log.h"

typedef unsigned int HHD, HDenum, HDerror;
typedef struct { HDerror errorCode; int internalErrorCode; HHD hHD; } HDErrorInfo;
typedef unsigned int (*Callback)(void *);

enum { COMM_ERROR = 0x0302, BAD_HANDLE = 0x0104, ILLEGAL_BEGIN = 0x0400, ILLEGAL_END = 0x0401,
       INVALID_OPERATION = 0x0102, HANDLE = 3 };
enum { NOTHING, ERROR, HANGS, NOT_A_NUMBER, FAR, NOT_CALIBRATED, NOT_OPENED };

static double place[3], wanted[3], held[3];
static int fault, at, in_frame, enabled, opened, started, forced;
static volatile int stopping, running;
static volatile int frames;
static HDerror last_error;
static Callback called;
static void *data;
static pthread_t thread, scheduler;

void fake_reset(int kind, int frame)
{
    fault = kind;
    at = frame;
    frames = enabled = forced = opened = in_frame = 0;
    last_error = 0;
    called = 0;
    place[0] = 0.7; /* in the wall */
    place[1] = -1.0;
    place[2] = -0.4;
    memset(held, 0, sizeof held);
}
void fake_place(double x, double y, double z) { place[0] = x; place[1] = y; place[2] = z; }
double fake_force(int axis) { return enabled ? held[axis] : 0.0; }
int fake_state(int which)
{
    return which == 0 ? opened : which == 1 ? enabled : which == 2 ? frames : which == 3 ? running
                                                                                 : forced;
}

static void fail(HDerror code) { last_error = code; }

static void *schedule(void *unused)
{
    const struct sched_param priority = {.sched_priority = 70};

    (void)unused;
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority); /* if it is permitted */
    scheduler = pthread_self(); /* before the first callback, wherever the starting thread is */
    running = 1;
    while (!stopping) {
        const struct timespec tick = {0, 1000000};

        nanosleep(&tick, NULL);
        if (called && !(fault == HANGS && frames >= at))
            called(data);
    }
    return NULL;
}

HHD hdInitDevice(const char *name)
{
    if (fault == NOT_OPENED || (name && strcmp(name, "Left Device"))) {
        fail(COMM_ERROR);
        return 0xFFFFFFFFu;
    }
    opened = 1;
    return HANDLE;
}
void hdDisableDevice(HHD device)
{
    fake_log()->closed++;
    if (device == HANDLE)
        opened = 0;
}
void hdEnable(HDenum what) { if (what == 0x4000) enabled = 1; }
void hdDisable(HDenum what)
{
    if (what == 0x4000) {
        enabled = 0;
        fake_log_force(0.0, 0.0, 0.0);
    }
}
HDenum hdCheckCalibration(void) { return fault == NOT_CALIBRATED ? 0x5002 : 0x5000; }

unsigned long hdScheduleAsynchronous(Callback callback, void *memory, unsigned short priority)
{
    (void)priority;
    data = memory;
    called = callback;
    return 77;
}
void hdUnschedule(unsigned long number) { if (number == 77) called = 0; }
void hdStartScheduler(void)
{
    stopping = 0;
    started = !pthread_create(&thread, NULL, schedule, NULL);
}
void hdStopScheduler(void)
{
    stopping = 1;
    if (started)
        pthread_join(thread, NULL);
    started = running = 0;
}

void hdBeginFrame(HHD device)
{
    if (device != HANDLE)
        fail(BAD_HANDLE);
    else if (in_frame || !running || !pthread_equal(pthread_self(), scheduler))
        fail(ILLEGAL_BEGIN);
    in_frame = 1;
}
void hdGetDoublev(HDenum what, double *values)
{
    const double wrong = fault == NOT_A_NUMBER ? NAN : 1e9;

    if (!in_frame || what != 0x2050)
        fail(INVALID_OPERATION);
    memcpy(values, place, sizeof place);
    if ((fault == NOT_A_NUMBER || fault == FAR) && frames >= at)
        values[1] = wrong;
}
void hdSetDoublev(HDenum what, const double *values)
{
    if (!in_frame || what != 0x2700)
        fail(INVALID_OPERATION);
    memcpy(wanted, values, sizeof wanted);
}
void hdEndFrame(HHD device)
{
    if (device != HANDLE || !in_frame)
        fail(ILLEGAL_END);
    if (fault == ERROR && frames >= at)
        fail(COMM_ERROR);
    fake_log_wait();
    memcpy(held, wanted, sizeof held);
    fake_log_force(fake_force(0), fake_force(1), fake_force(2));
    forced |= held[0] != 0.0 || held[1] != 0.0 || held[2] != 0.0;
    in_frame = 0;
    frames++;
}
HDErrorInfo hdGetError(void)
{
    const HDErrorInfo info = {last_error, -7, HANDLE};

    last_error = 0;
    return info;
}
const char *hdGetErrorString(HDerror code)
{
    return code == COMM_ERROR ? "communication error" : "an error";
}
