
/*
 * Return the potential energy [J] at a position [m]: the force is minus its gradient.@unlimited@
 */
@link@ @real@ @name@_energy(const @real@ position[3]);
