"""What was taken for a surface, in words."""

from __future__ import annotations

from asperity.surface import Surface


def law_parameters(surface: Surface) -> list[str]:
    """Return the parameters of a surface's law, one sentence each.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> law_parameters(Surface(Sinusoid(1e-4, 1e-3), "F", friction=0.3))[:2]
        ['Given friction 0.3', 'Default max deflection 1 mm']
    """
    said = []
    for name, argument in surface.law.arguments.items():
        value = surface.law_parameters[name]
        kind = "Default" if value == argument.default else "Given"
        said.append(f"{kind} {name.replace('_', ' ')} {argument.readable(value)}")
    return said
