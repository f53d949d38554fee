@link@ int @name@_abi_version(void)
{
    return @NAME@_ABI;
}

@link@ size_t @name@_state_size(void)
{
    return sizeof(@name@_state);
}

@link@ uint32_t @name@_info(@name@_facts *facts)
{
    const @name@_facts own = {
        (uint32_t)sizeof(@name@_facts), @NAME@_ABI, (uint32_t)sizeof(@real@),
        (uint32_t)sizeof(@name@_state), @NAME@_STIFFNESS, @NAME@_MAX_DEPTH, @NAME@_Q_UPPER,
        @NAME@_Q_PLUS_UPPER, @NAME@_MAX_FORCE, @NAME@_MAX_PRESS, @NAME@_FRICTION,
        @NAME@_PRESLIDING_STIFFNESS, @NAME@_FRICTION_MODULATION, @NAME@_MAX_DEFLECTION,
        @NAME@_HOLDS_DEEPER, "@real@", @NAME@_CONTENT, @NAME@_LAW};
    const unsigned char *from = (const unsigned char *)&own;
    unsigned char *to = (unsigned char *)facts;
    const uint32_t size = facts->size < own.size ? facts->size : own.size;
    uint32_t i;
    if (size < 8) {
        return 0;
    }
    for (i = 0; i < size; i++) {
        to[i] = from[i];
    }
    facts->size = size;
    return size;
}

