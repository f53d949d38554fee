@note@#include "@stem@.h"

#if defined(@NAME@_POSIX)
#include <sys/mman.h>
#endif

@guards@
@inside@
