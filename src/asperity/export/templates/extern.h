/* The data of the surface are in @stem@_data.c: compile and link it, too. */
#if defined(__cplusplus)
extern "C" {
#endif
@declared@#if defined(__cplusplus)
}
#endif
