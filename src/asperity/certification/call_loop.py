"""Compiled loop that calls the C functions of a renderer along many paths."""

from asperity.core.compiled import FloatArray, IntArray, Kernels, call_address, store_release

KERNELS = Kernels(loops=("call_renderer",), native=("call_address", "store_release"))


def call_renderer(
    reset: int, force: int, state: int, paths: FloatArray, forces: FloatArray, progress: IntArray
) -> None:
    """Compute the forces along paths, each of which begins after a reset.

    Args:
        reset: address of ``void reset(void *state)``.
        force: address of ``void force(void *state, const double position[3], double force[3])``.
        state: address of the state.
        paths: positions in the unit of the renderer, shape (n, m, 3).
        forces: result, shape (n, m, 3).
        progress: number of the call in progress, shape (1,), which outlives a crash.
    """
    steps = paths.shape[1]
    for i in range(paths.shape[0]):
        call_address(reset, state)
        for j in range(steps):
            store_release(progress, 0, i * steps + j)
            call_address(force, state, paths[i, j], forces[i, j])
