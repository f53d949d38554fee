/* Forget the anchor: before the first call, and when the loop was interrupted. */
@link@ void @name@_reset(@name@_state *state)
{
    state->anchor[0] = 0;
    state->anchor[1] = 0;
    state->held = 0;
}

/*
 * Write the force on the probe [N] at its position [m]; once in each tick of the loop.
 * Zero for a position that is not finite or farther than @far@ m from the origin.
 */
@link@ void @name@_force(@name@_state *state, const @real@ position[3], @real@ force[3])
{
    const @real@ x = position[0];
    const @real@ y = position[1];
    const @real@ z = position[2];
    @held_type@ now;
    if (!(@abs@(x) <= @far@ && @abs@(y) <= @far@ && @abs@(z) <= @far@)) {
        force[0] = force[1] = force[2] = 0;
        @name@_reset(state);
        return;
    }
    now = @held@(x, y, z, state->anchor[0], state->anchor[1], state->held);
    force[0] = now.f0;
    force[1] = now.f1;
    force[2] = now.f2;
    state->anchor[0] = now.f3;
    state->anchor[1] = now.f4;
    state->held = now.f5;
}
