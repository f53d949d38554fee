/* A bare loop: wait for the next sample, nothing else. Prints samples, late ones, worst lateness.
 *
 * Late is a sample that is done when the next one is due, as the loop of asperity counts it. Both ask
 * for real-time priority and locked memory. */
#define _GNU_SOURCE
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>

static int64_t now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

int main(int count, char **words)
{
    const int64_t period = count > 1 ? atoll(words[1]) : 1000000;
    const int64_t span = (int64_t)(1e9 * (count > 2 ? atof(words[2]) : 1.0));
    const struct sched_param asked = {.sched_priority = 80};
    int64_t due = now(), end = due + span, samples = 0, late = 0, worst = 0;

    prctl(PR_SET_TIMERSLACK, 1UL, 0, 0, 0);
    sched_setscheduler(0, SCHED_FIFO, &asked);
    mlockall(MCL_CURRENT | MCL_FUTURE);
    while (due < end) {
        const struct timespec t = {due / 1000000000, due % 1000000000};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
        const int64_t done = now();
        const int64_t over = done > due + period ? (done - due) / period - 1 : 0;
        samples++;
        late += done > due + period;
        if (done - due > worst)
            worst = done - due;
        due += (1 + over) * period;
    }
    printf("%lld %lld %lld\n", (long long)samples, (long long)late, (long long)worst);
    return 0;
}
