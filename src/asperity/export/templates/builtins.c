/*
 * With @NAME@_NO_LIBC, defined before this header, no header of the C library is used; functions
 * without an instruction of their own (sin, fmod, ...) are declared by the compiler and linked.
 */
#if defined(@NAME@_NO_LIBC)
@defined@#endif
