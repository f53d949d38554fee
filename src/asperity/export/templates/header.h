@note@#ifndef @NAME@_H
#define @NAME@_H

@includes@#if defined(@NAME@_POSIX)
#include <sys/mman.h>
#endif

@guards@
@contract@
@inside@
#if defined(__clang__)
#pragma STDC FP_CONTRACT DEFAULT
#elif defined(@NAME@_UNFUSED)
#pragma GCC pop_options
#endif

#endif /* @NAME@_H */
