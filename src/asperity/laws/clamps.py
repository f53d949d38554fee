"""Depth clamps: which components of a law's force are evaluated at ``max_depth`` below it."""

from __future__ import annotations

from dataclasses import dataclass

from asperity.core.errors import ParameterError

_FORCE = ("fx", "fy", "fz")
_JACOBIAN = tuple(f"j{row}{column}" for row in range(3) for column in range(3))


@dataclass(frozen=True)
class Clamp:
    """A depth clamp of a law that can be clamped.

    Attributes:
        name: one word.
        summary: one line for help and tables.
        held_components: components of the force (0, 1, 2 for x, y, z) that are evaluated at
            max_depth wherever the depth is greater.
        has_backing_wall: whether a wall k (z_b - z) e_z is added below z_b, the
            :attr:`~asperity.surface.Surface.floor` of the surface.
    """

    name: str
    summary: str
    held_components: tuple[int, ...] = ()
    has_backing_wall: bool = False

    def __str__(self) -> str:
        return self.name

    @property
    def changes_force(self) -> bool:
        """Whether the force differs from the law's anywhere."""
        return bool(self.held_components) or self.has_backing_wall

    @property
    def holds_whole_force(self) -> bool:
        """Whether the force is constant below max_depth, down to a backing wall.

        What is proved of such a force below max_depth holds at every depth.
        """
        return self.held_components == (0, 1, 2)

    @property
    def has_potential(self) -> bool:
        """Whether the clamped force of a conservative law has a potential in closed form."""
        return self.holds_whole_force or not self.held_components

    def force_code(self, call: str) -> list[str]:
        """Return the lines of a compiled function that assign ``fx, fy, fz`` in contact.

        Args:
            call: the call that returns the law's force at ``depth``.
        """
        lines = [f"fx, fy, fz = {call}"]
        if self.holds_whole_force:
            lines.insert(0, "depth = min(depth, clamp_depth)")
        elif self.held_components:
            lines += self._clamped_branch(f"    {self._held(_FORCE, (0, 1, 2))} = {call}")
        return [*lines, *self._wall_branch("fz += k * (floor - z)")]

    def jacobian_code(self, call: str, *held_calls: str) -> list[str]:
        """Return the lines that assign ``fx, fy, fz`` and ``j00`` to ``j22`` in contact.

        Args:
            call: the call that returns the law's force and Jacobian.
            held_calls: if the clamp changes the force, the calls that return the force and the
                Jacobian of the force at a fixed depth.
        """
        lines = [f"{', '.join((*_FORCE, *_JACOBIAN))} = {call}"]
        if self.held_components:
            force, saturated = held_calls
            rows = [row for row in range(3) for _ in range(3)]
            lines += self._clamped_branch(
                f"    {self._held(_FORCE, (0, 1, 2))} = {force}",
                f"    {self._held(_JACOBIAN, rows)} = {saturated}",
            )
        return [*lines, *self._wall_branch("fz += k * (floor - z)", "j22 -= k")]

    def energy_code(self, call: str) -> list[str]:
        """Return the lines that assign ``energy`` in contact.

        Args:
            call: the call that returns the law's energy and its derivative by the depth.
        """
        lines = [f"energy, rate = {call}"]
        if self.holds_whole_force:  # the force is constant along the rest of the depth
            above = ["beyond = max(depth - clamp_depth, 0.0)", "depth = min(depth, clamp_depth)"]
            lines = [*above, *lines, "energy += rate * beyond"]
        return [*lines, *self._wall_branch("energy += 0.5 * k * (floor - z) * (floor - z)")]

    def _held(self, names: tuple[str, ...], components: list[int] | tuple[int, ...]) -> str:
        targets = ["_unclamped"] * len(names)
        for index, component in enumerate(components):
            if component in self.held_components:
                targets[index] = names[index]
        return ", ".join(targets)

    def _clamped_branch(self, *assignments: str) -> list[str]:
        return ["if depth > clamp_depth:", "    depth = clamp_depth", *assignments]

    def _wall_branch(self, *statements: str) -> list[str]:
        if not self.has_backing_wall:
            return []
        return ["if z < floor:", *[f"    {statement}" for statement in statements]]


NONE = Clamp("none", "the law as it is")
WHOLE = Clamp("whole", "the depth is held at max_depth", (0, 1, 2))
LATERAL = Clamp("lateral", "the depth of the lateral force is held at max_depth", (0, 1))
BACKED = Clamp("backed", "whole, with a backing wall below it", (0, 1, 2), has_backing_wall=True)

CLAMPS = {clamp.name: clamp for clamp in (NONE, WHOLE, LATERAL, BACKED)}
"""The clamps by name."""


def find_clamp(name: str) -> Clamp:
    """Return a clamp by its name.

    Raises:
        ParameterError: for an unknown name.
    """
    if name not in CLAMPS:
        raise ParameterError("clamp", f"must be one of {', '.join(CLAMPS)}", name)
    return CLAMPS[name]
