#if !defined(@NAME@_NO_LIBC)
#include <math.h>
#elif !defined(HUGE_VAL)
#define HUGE_VAL __builtin_huge_val()
#endif
#include <stddef.h>
#include <stdint.h>
