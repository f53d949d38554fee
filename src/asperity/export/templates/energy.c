
@link@ @real@ @name@_energy(const @real@ position[3])
{
    const @real@ x = position[0];
    const @real@ y = position[1];
    const @real@ z = position[2];
    if (!(@abs@(x) <= @far@ && @abs@(y) <= @far@ && @abs@(z) <= @far@)) {
        return 0;
    }
    return @energy@(x, y, z);
}
