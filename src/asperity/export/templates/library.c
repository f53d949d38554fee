@note@#include "@stem@.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#if defined(@NAME@_POSIX)
#include <sys/mman.h>
#endif

@guards@
@inside@
