/* What a stand-in was told, in a file that another process reads: ASPERITY_FAKE_LOG names it. */

#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

struct fake_log {
    double force[3];            /* commanded last [N] */
    volatile long long zero_at; /* when it became zero [ns]; 0 while it is not */
    volatile long long written; /* commands so far */
    volatile long long closed;  /* calls that closed the device */
    volatile long long stall;   /* to wait in the next command [ns], set by the reader */
    volatile long long pid;     /* of the process that opened the device */
};

static struct fake_log *fake_log(void)
{
    static struct fake_log none, *seen = 0;
    const char *path = getenv("ASPERITY_FAKE_LOG");

    if (!seen) {
        int file = path ? open(path, O_RDWR) : -1;
        void *memory = file < 0 ? MAP_FAILED
                                : mmap(0, sizeof none, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        seen = memory == MAP_FAILED ? &none : memory;
        seen->pid = getpid();
    }
    return seen;
}

static void fake_log_wait(void)
{
    struct fake_log *log = fake_log();
    struct timespec wait = {log->stall / 1000000000, log->stall % 1000000000};

    log->stall = 0;
    while (nanosleep(&wait, &wait)) {
    }
}

static void fake_log_force(double x, double y, double z)
{
    struct fake_log *log = fake_log();
    struct timespec now;
    const int zero = x == 0.0 && y == 0.0 && z == 0.0;

    clock_gettime(CLOCK_MONOTONIC, &now);
    log->force[0] = x;
    log->force[1] = y;
    log->force[2] = z;
    if (!zero)
        log->zero_at = 0;
    else if (!log->zero_at)
        log->zero_at = now.tv_sec * 1000000000LL + now.tv_nsec;
    log->written++;
}
