
/*
 * Return the potential energy [J] at a position [m]: the force is minus its gradient.
 * A search has no limit of evaluations here: not for a real-time loop.
 */
@link@ @real@ @name@_energy(const @real@ position[3]);
