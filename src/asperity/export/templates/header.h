@note@#ifndef @NAME@_H
#define @NAME@_H

#include <math.h>
#include <stdint.h>

#if defined(__FAST_MATH__)
#error "compile without -ffast-math: the force would not be the one that was analysed"
#endif
#if (-1 >> 1) != -1
#error "the shift of a negative integer must keep its sign"
#endif
/* A product and a sum that are rounded once (FMA) would change the last bits. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize ("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract (off)
#endif
/* Small functions: a call would cost more than they do. */
#if defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(__OPTIMIZE_SIZE__)
#define @NAME@_INLINE static inline __attribute__((always_inline))
#else
#define @NAME@_INLINE static inline
#endif

#define @NAME@_STIFFNESS @stiffness@ /* k [N/m] */
#define @NAME@_MAX_DEPTH @max_depth@ /* [m] */
#define @NAME@_Q_UPPER @q_upper@ /* the force changes by at most this times k per metre */
#define @NAME@_CONTENT "@content@"

/* Carried from call to call: the anchor of friction. Other laws leave it alone. */
typedef struct @name@_state {
    @real@ anchor[2]; /* [m] */
    int held;
} @name@_state;

@inside@
#if defined(__clang__)
#pragma STDC FP_CONTRACT DEFAULT
#elif defined(__GNUC__)
#pragma GCC pop_options
#endif

#endif /* @NAME@_H */
