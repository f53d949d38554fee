#define @NAME@_STIFFNESS @stiffness@ /* k [N/m] */
#define @NAME@_MAX_DEPTH @max_depth@ /* [m] */
#define @NAME@_Q_UPPER @q_upper@ /* upper bound of the change of force per metre, over k */
#define @NAME@_MAX_EVALUATIONS @max_evaluations@ /* budget of surface evaluations per tick */
#define @NAME@_Q_PLUS_UPPER @q_plus@ /* the same of its growth inwards */
#define @NAME@_MAX_FORCE @max_force@ /* greatest force on a straight scan at max_depth, with friction [N] */
#define @NAME@_MAX_PRESS @max_press@ /* mean normal force on it [N] */
#define @NAME@_HOLDS_DEEPER @holds_deeper@ /* 1: q and q_plus hold at any depth and press */
#define @NAME@_FRICTION @friction@ /* coefficient [1] */
#define @NAME@_PRESLIDING_STIFFNESS @presliding_stiffness@ /* [N/m] */
#define @NAME@_FRICTION_MODULATION @friction_modulation@ /* [1] */
#define @NAME@_MAX_DEFLECTION @max_deflection@ /* of the anchor of a law with one [m] */
#define @NAME@_CONTENT "@content@" /* digest of surface and law, as in recordings of asperity */
#define @NAME@_LAW @law@

@abi_header@
/* State between calls: the anchor of friction, and the warm start of the search. */
typedef struct @name@_state {
    @real@ anchor[3]; /* [m] */
    @real@ memory[@memory@];
    int32_t mark; /* zero, or of this surface: another one resets the state */
} @name@_state;

/*
 * Reset the state before the first call and after an interruption of the loop. A state of zeros is
 * valid; one that was never reset, or is another surface's, is reset by the first call.
 */
@link@ void @name@_reset(@name@_state *state);

/*
 * Compute the force on the probe [N] at its position [m], once per tick of the loop.
 * The force is zero for a position that is not finite, or with a coordinate beyond @far@ m.
 */
@link@ void @name@_force(@name@_state *state, const @real@ position[3], @real@ force[3]);

/*
 * Return the error bound of the last search [m]: no point of the surface is closer by more than
 * this. 0 if the search converged within its limit of evaluations, or if the law does not search.
 */
@link@ @real@ @name@_gap(const @name@_state *state);

/*
 * Touch all data of the surface, so that no tick waits for a page of memory. Call it before the
 * loop. Returns 1 if the data are locked in memory as well, else 0: locking takes @NAME@_POSIX,
 * defined before this header, and a sufficient limit of the system (ulimit -l).
 */
@link@ int @name@_prepare(void);
