/* A handle that another process moves, through a file that both map: place (3 numbers), commanded
 * force (3), what reading returns, and whether the device is open. */

#define _POSIX_C_SOURCE 200809L
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

static volatile double *map;

int asperity_open(void)
{
    const char *name = getenv("MAPPED_DEVICE");
    const int file = name ? open(name, O_RDWR) : -1;
    void *found;

    if (file < 0)
        return 1;
    found = mmap(0, 8 * sizeof(double), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (found == MAP_FAILED)
        return 2;
    map = found;
    map[7] = 1.0;
    return 0;
}

int asperity_read(double position[3])
{
    for (int i = 0; i < 3; i++)
        position[i] = map[i];
    return (int)map[6];
}

int asperity_write(const double force[3], int contact)
{
    (void)contact;
    for (int i = 0; i < 3; i++)
        map[3 + i] = force[i];
    return 0;
}

int asperity_close(void)
{
    if (map)
        map[7] = 0.0;
    return 0;
}
