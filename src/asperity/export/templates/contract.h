#define @NAME@_STIFFNESS @stiffness@ /* k [N/m] */
#define @NAME@_MAX_DEPTH @max_depth@ /* [m] */
#define @NAME@_Q_UPPER @q_upper@ /* the force changes by at most this times k per metre */
#define @NAME@_LOOKS @looks@ /* evaluations of the surface that a search may take in a tick */
#define @NAME@_CONTENT "@content@" /* of surface and law, as in recordings of asperity */

/* Carried from call to call: the anchor of friction, and where the last search ended. */
typedef struct @name@_state {
    @real@ anchor[2]; /* [m] */
    @real@ memory[@memory@];
    int held;
} @name@_state;

/* Forget everything: before the first call, and when the loop was interrupted. */
@link@ void @name@_reset(@name@_state *state);

/*
 * Write the force on the probe [N] at its position [m]; once in each tick of the loop.
 * Zero for a position that is not finite or farther than @far@ m from the origin.
 */
@link@ void @name@_force(@name@_state *state, const @real@ position[3], @real@ force[3]);

/*
 * Return how far from certain the last force is [m]: @gap@
 */
@link@ @real@ @name@_gap(const @name@_state *state);
