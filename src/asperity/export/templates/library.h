@note@#ifndef @NAME@_H
#define @NAME@_H

#include <math.h>

#if defined(_WIN32) && defined(@NAME@_BUILD)
#define @NAME@_API __declspec(dllexport)
#elif defined(_WIN32)
#define @NAME@_API __declspec(dllimport)
#elif defined(__GNUC__)
#define @NAME@_API __attribute__((visibility("default")))
#else
#define @NAME@_API
#endif

#if defined(__cplusplus)
extern "C" {
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

/* Forget the anchor: before the first call, and when the loop was interrupted. */
@NAME@_API void @name@_reset(@name@_state *state);

/*
 * Write the force on the probe [N] at its position [m]; once in each tick of the loop.
 * Zero for a position that is not finite or farther than @far@ m from the origin.
 */
@NAME@_API void @name@_force(@name@_state *state, const @real@ position[3], @real@ force[3]);
@declared@
#if defined(__cplusplus)
}
#endif

#endif /* @NAME@_H */
