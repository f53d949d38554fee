@note@#include "@stem@.h"

#include <math.h>
#include <stdint.h>

@guards@
@inside@
