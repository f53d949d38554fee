#if defined(__FAST_MATH__)
#error "compile without -ffast-math: the force would not be the one that was analysed"
#endif
#if (-1 >> 1) != -1
#error "the shift of a negative integer must keep its sign"
#endif
/*
 * A product and a sum that are rounded once (FMA) would change the last bits. In ISO C (-std=c99)
 * gcc makes none unless told to; elsewhere it has to be kept from it, and then does not inline.
 */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__) && (defined(__cplusplus) || !defined(__STRICT_ANSI__))
#define @NAME@_UNFUSED
#pragma GCC push_options
#pragma GCC optimize ("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract (off)
#endif
/* gcc makes a branch of the smaller of a number and a known one: a parameter is read instead. */
#define @NAME@_READ(number) (*(const volatile @real@ *)&(number))
/*
 * Small functions: a call would cost more than they do. And where a probe touches nothing is rare:
 * what is needed in contact shall not wait for it.
 */
#if defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(__OPTIMIZE_SIZE__)
#define @NAME@_INLINE static inline __attribute__((always_inline))
#define @NAME@_RARE(test) __builtin_expect(!!(test), 0)
#else
#define @NAME@_INLINE static inline
#define @NAME@_RARE(test) (test)
#endif
