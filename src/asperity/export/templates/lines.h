/* Rows of 64 bytes, each in one line of the cache. */
#if !defined(@NAME@_LINES) && defined(__GNUC__)
#define @NAME@_LINES __attribute__((aligned(64)))
#elif !defined(@NAME@_LINES)
#define @NAME@_LINES
#endif
