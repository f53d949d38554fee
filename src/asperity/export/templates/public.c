@link@ void @name@_reset(@name@_state *state)
{
    int i;
    state->anchor[0] = 0;
    state->anchor[1] = 0;
    state->anchor[2] = 0;
    state->mark = @mark@;
    for (i = 0; i < @memory@; i++) {
        state->memory[i] = 0;
    }
}

@link@ void @name@_force(@name@_state *state, const @real@ position[3], @real@ force[3])
{
    const @real@ x = position[0];
    const @real@ y = position[1];
    const @real@ z = position[2];
    @tick_type@ now;
    if (!(@abs@(x) <= @far@ && @abs@(y) <= @far@ && @abs@(z) <= @far@)) {
        force[0] = force[1] = force[2] = 0;
        @name@_reset(state);
        return;
    }
    if (state->mark != @mark@ && state->mark != @held@) {
        @name@_reset(state);
    }
    state->memory[@at_budget@] = @budget@;
    state->memory[@at_gap@] = 0;
    now = @tick@(x, y, z, state->anchor[0], state->anchor[1], state->anchor[2],
        state->mark == @held@, state->memory);
    force[0] = now.f0;
    force[1] = now.f1;
    force[2] = now.f2;
    state->anchor[0] = now.f3;
    state->anchor[1] = now.f4;
    state->anchor[2] = now.f5;
    state->mark = now.f6 ? @held@ : @mark@;
}

@link@ @real@ @name@_gap(const @name@_state *state)
{
    return state->memory[@at_gap@];
}

@link@ int @name@_prepare(void)
{
    const struct {
        const void *data;
        size_t size;
    } parts[] = {@parts@{NULL, 0}};
    int locked = 1, k;
    for (k = 0; parts[k].data != NULL; k++) {
        const volatile unsigned char *bytes = (const volatile unsigned char *)parts[k].data;
        size_t i;
        for (i = 0; i < parts[k].size; i += 4096) {
            (void)bytes[i];
        }
        (void)bytes[parts[k].size - 1];
#if defined(@NAME@_POSIX)
        locked = mlock(parts[k].data, parts[k].size) == 0 && locked;
#else
        locked = 0;
#endif
    }
    return locked;
}
