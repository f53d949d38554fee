#if defined(__FAST_MATH__)
#error "compile without -ffast-math: the force would differ from the analyzed one"
#endif
#if (-1 >> 1) != -1
#error "the shift of a negative integer must keep its sign"
#endif
/*
 * Fused multiply-add would change the last bits. In ISO C (-std=c99) gcc does not use it by
 * default; elsewhere it is disabled, which prevents inlining.
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
/* gcc compiles a minimum with a known constant to a branch: the constant is read from memory. */
#define @NAME@_READ(number) (*(const volatile @real@ *)&(number))
/*
 * Small functions are inlined. The branch without contact is marked as unlikely, since the time in
 * contact matters.
 */
#if defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(__OPTIMIZE_SIZE__)
#define @NAME@_INLINE static inline __attribute__((always_inline))
#define @NAME@_RARE(test) __builtin_expect(!!(test), 0)
#else
#define @NAME@_INLINE static inline
#define @NAME@_RARE(test) (test)
#endif
