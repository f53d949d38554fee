"""A surface: a texture, a law and its parameters, with compiled force and Jacobian."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.arguments import DEFAULT_STIFFNESS, MAX_DEPTH, STIFFNESS, Argument
from asperity.checks import FloatArray, Points, array, positive
from asperity.checks import points as read_points
from asperity.contacts.memory import UNLIMITED, checked_memory, new_memory
from asperity.derive.facts import LawFacts, clamped_facts
from asperity.display import Plotted
from asperity.errors import ParameterError, nearest_names
from asperity.kernels.probe import CLAMPS, ClampName
from asperity.laws import KNOWN_LAWS, LAW_ARGUMENTS, LAWS, Law, find_law
from asperity.textures.naming import TextureLike, as_texture
from asperity.textures.texture import Texture

# max_depth unless given: the peak-to-valley height of the texture, at most this [m].
LARGEST_DEFAULT_DEPTH = 1e-3

LAW = Argument("law", "letter or name of the law", default="C", form="text")
CLAMP = Argument(
    "clamp", "what holds the depth at max_depth", default="none", form="text", choices=CLAMPS
)

DEFAULT_PARAMETERS = {
    name: default for law in LAWS.values() for name, default in law.parameters.items()
}
"""The defaults of the shipped laws' parameters."""


def default_max_depth(texture: Texture) -> float:
    """Return the peak-to-valley height of the texture, at most 1 mm [m]."""
    height = texture.peak_to_valley
    return min(height, LARGEST_DEFAULT_DEPTH) if height > 0.0 else LARGEST_DEFAULT_DEPTH


class Surface(Plotted):
    """A textured surface as a force field: the body is z < h(x, y), z points out of it.

    Args:
        texture: the height function, or what names it on the command line: "sandpaper:grit=P60",
            "cloth", the path of a measured file; see :func:`~asperity.textures.naming.as_texture`.
        law: letter, name, or a :class:`~asperity.laws.Law` of your own.
        stiffness: k [N/m] of the smooth wall.
        max_depth: D [m], the depth to which the surface is meant to be pressed; it bounds the
            working region of the analysis and is where a clamp acts. Default: the peak-to-valley
            height of the texture, at most 1 mm.
        friction: μ of law F; default 0.8.
        max_deflection: d_max [m] of law F, the greatest deflection of the anchor; default 1 mm.
        modulation_depth: a_m of law F, in [0, 1]; default 0.8.
        clamp: ``"none"`` (the law as it is), ``"whole"`` (the depth is held at max_depth),
            ``"lateral"`` (only for the lateral force, the paper's Remark 3), ``"backed"`` (whole,
            with a backing wall k (z_b - z) e_z below z_b = min h - max_depth, or -max_depth for
            laws on the nominal contact). Laws W, D, E and H are never clamped.
        continuity: c of law H, positive: its characteristic number is max(1, c); default 1.
        law_parameters: values for the parameters that the law declares, a law of your own
            included; the four keywords above are a convenience for those of the shipped laws.

    A surface is frozen. ``law_parameters`` of the result are the parameters of its law, complete
    with their defaults: kernels and certificates read them there and nowhere else.

    Raises:
        ParameterError: for a value that cannot be used; it names the argument.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.8e-3, period=1e-3), law="A", stiffness=500.0)
        >>> surface.force([[0.25e-3, 0.0, 0.0], [0.25e-3, 0.0, 1e-3]])
        array([[0. , 0. , 0.4],
               [0. , 0. , 0. ]])
    """

    texture: Texture
    law: Law
    stiffness: float
    max_depth: float
    clamp: ClampName
    law_parameters: Mapping[str, float]
    _given: Mapping[str, float]

    def __init__(
        self,
        texture: TextureLike,
        law: str | Law = "C",
        stiffness: float = DEFAULT_STIFFNESS,
        max_depth: float | None = None,
        friction: float | None = None,
        max_deflection: float | None = None,
        modulation_depth: float | None = None,
        clamp: ClampName = "none",
        continuity: float | None = None,
        law_parameters: Mapping[str, float] | None = None,
    ) -> None:
        own, made = find_law(law), as_texture(texture)
        keywords = {
            "friction": friction,
            "max_deflection": max_deflection,
            "modulation_depth": modulation_depth,
            "continuity": continuity,
        }
        given = {
            name: LAW_ARGUMENTS[name].checked(value)
            for name, value in keywords.items()
            if value is not None
        }
        named = own.checked(law_parameters or {})
        for name in given.keys() & named.keys():
            raise ParameterError(
                name, "is given twice, by keyword and in law_parameters", named[name]
            )
        if clamp not in CLAMPS:
            raise ParameterError("clamp", f"must be one of {', '.join(CLAMPS)}", clamp)
        depth = default_max_depth(made) if max_depth is None else MAX_DEPTH.checked(max_depth)
        self._set(
            texture=made,
            law=own,
            stiffness=STIFFNESS.checked(stiffness),
            max_depth=depth,
            clamp=clamp,
            _given=given | named,
        )

    def _set(self, **values: Any) -> None:
        """Fill a new surface, the parameters of its law completed with the law's defaults."""
        law, given = values["law"], values["_given"]
        parameters = {
            name: argument.checked(given[name]) if name in given else float(law.parameters[name])
            for name, argument in law.arguments.items()
        }
        if law.stateful and "max_deflection" in parameters:  # the derivation asks for it
            positive("max_deflection", parameters["max_deflection"], "m")
        self.__dict__.update(values, law_parameters=MappingProxyType(parameters))

    def _chosen(self) -> dict[str, Any]:
        names = ("texture", "law", "stiffness", "max_depth", "clamp", "_given")
        return {name: getattr(self, name) for name in names}

    def _changed(self, **values: Any) -> Surface:
        """Return a surface that differs in these values only; nothing derived is taken along."""
        result = object.__new__(type(self))
        result._set(**self._chosen() | values)
        return result

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process makes the same one of: a law that is known is its letter.

        A law of the user's own is found there if that process has learned it.
        """
        known = KNOWN_LAWS.get(self.law.letter) is self.law
        return self._chosen() | {"law": self.law.letter if known else self.law}

    def __setstate__(self, values: dict[str, Any]) -> None:
        self._set(**values | {"law": find_law(values["law"])})

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(
            f"a surface is not changed: {name} belongs to a new one, "
            "by to_law, to_stiffness, to_depth or Surface(...)"
        )

    __delattr__ = None  # type: ignore[assignment]  # nothing of a surface is taken away

    def __repr__(self) -> str:
        return (
            f"Surface({self.texture!r}, law={self.law.letter!r}, stiffness={self.stiffness!r}, "
            f"max_depth={self.max_depth!r}, clamp={self.clamp!r})"
        )

    def to_depth(self, max_depth: float) -> Surface:
        """Return the same surface for another max_depth [m].

        Raises:
            ParameterError: for a depth that is not positive.
        """
        return self._changed(max_depth=MAX_DEPTH.checked(max_depth))

    def to_texture(self, texture: TextureLike, max_depth: float | None = None) -> Surface:
        """Return the same law, stiffness and depth on another texture.

        Args:
            texture: the other one, or what names it.
            max_depth: [m], if it is to change too.

        Raises:
            ParameterError: for a depth that is not positive.
        """
        depth = self.max_depth if max_depth is None else MAX_DEPTH.checked(max_depth)
        return self._changed(texture=as_texture(texture), max_depth=depth)

    def to_stiffness(self, stiffness: float) -> Surface:
        """Return the same surface with another stiffness [N/m].

        Raises:
            ParameterError: for a stiffness that is not positive.
        """
        return self._changed(stiffness=STIFFNESS.checked(stiffness))

    def to_law(self, law: str | Law, law_parameters: Mapping[str, float] | None = None) -> Surface:
        """Return the same texture with another law, everything else as it is.

        Values that were given for parameters go along, also those that only the other law has.

        Args:
            law: the other law.
            law_parameters: further values for the parameters that it declares.

        Raises:
            ParameterError: for an unknown law, or a value that cannot be used.
        """
        other = find_law(law)
        given = other.checked(law_parameters or {})
        return self._changed(law=other, _given={**self._given, **given})

    def parameter(self, name: str) -> float:
        """Return the value in effect of a parameter of the law.

        Raises:
            ParameterError: for a name that the law does not declare.
        """
        if name not in self.law_parameters:
            hint = nearest_names(name, self.law_parameters) if self.law_parameters else "none"
            raise ParameterError("name", f"is no parameter of law {self.law}: {name!r}; {hint}")
        return self.law_parameters[name]

    def _in_effect(self, name: str) -> float:
        """Return a shipped law's parameter: the law's own, else as given for other laws."""
        if name in self.law_parameters:
            return self.law_parameters[name]
        return self._given.get(name, DEFAULT_PARAMETERS[name])

    @property
    def friction(self) -> float:
        """μ [1] of law F: this surface's own, else the one that :meth:`to_law` hands on."""
        return self._in_effect("friction")

    @property
    def max_deflection(self) -> float:
        """d_max [m] of law F; see :attr:`friction`."""
        return self._in_effect("max_deflection")

    @property
    def modulation_depth(self) -> float:
        """a_m [1] of law F; see :attr:`friction`."""
        return self._in_effect("modulation_depth")

    @property
    def continuity(self) -> float:
        """C [1] of law H; see :attr:`friction`."""
        return self._in_effect("continuity")

    @property
    def acting_clamp(self) -> ClampName:
        """The clamp that changes the force: ``"none"`` for a law that is never clamped."""
        return self.clamp if self.law.clampable else "none"

    @property
    def facts(self) -> LawFacts:
        """What the symbols say of the force that is rendered, of law and clamp together."""
        return clamped_facts(self.law, self.acting_clamp)

    @property
    def feels_texture(self) -> bool:
        """Whether the texture has a part in the force; the smooth wall alone has none.

        Such a force may act in any direction, and change with the position in any.
        """
        return self.law.contact.begins_on_texture or self.facts.looks_at_surface

    @property
    def clamped_depth(self) -> float:
        """The depth [m] at which the probe is below z_b wherever it is; max_depth without a clamp.

        What holds for a field under a clamp is stated down to there at least.
        """
        if self.acting_clamp == "none":
            return self.max_depth
        low, high = self.law.contact.extremes(self.texture)
        return self.max_depth + (high - low)

    @property
    def floor(self) -> float:
        """z_b [m], below which ``clamp="backed"`` adds its wall."""
        return self.law.contact.extremes(self.texture)[0] - self.max_depth

    @cached_property
    def law_arguments(self) -> tuple[float, ...]:
        """What the kernels receive of the law: see ``asperity.kernels.probe``."""
        from asperity.kernels.fuse import kernel_source

        # The extremes of a map cost time: only for a law that looks at the relative height.
        relative = "h_mid" in kernel_source(self.law)
        low, high = self.texture.extremes if relative else (-1.0, 1.0)
        half = 0.5 * (high - low)
        return (
            self.stiffness,
            0.5 * (low + high),
            half if half > 0.0 else 1.0,  # a flat texture modulates nothing
            self.max_depth,
            self.floor if self.clamp == "backed" else 0.0,
            *self.law_parameters.values(),
        )

    @cached_property
    def _loops(self) -> ModuleType:
        from asperity.kernels.fuse import fuse_surface

        return fuse_surface(self.law, self.texture.sampler, self.acting_clamp)

    @cached_property
    def _force_batch(self) -> Any:  # Numba is untyped
        return self._loops.force_batch

    def force(self, points: ArrayLike, deflection: ArrayLike | None = None) -> FloatArray:
        """Return the force on the probe (what the device applies to the hand).

        Args:
            points: probe positions p [m], shape (n, 3), or (3,) for one: then all here and in the
                answer is without the first axis.
            deflection: tangential deflection d of the anchor [m], shape (n, 2), for laws with
                state; zero by default.

        Returns:
            f [N], shape (n, 3); zero out of contact.

        Raises:
            ParameterError: for another shape, values that are not finite, a deflection longer
                than max_deflection, or a deflection for a law without state.

        Reference:
            The paper's Table I, with the corrections named in each law.
        """
        probes = read_points("points", points, 3, "m")
        out = np.empty(probes.rows.shape)
        texture, law = self.texture.arguments, self.law_arguments
        if deflection is None and not self.law.stateful:
            self._force_batch(probes.rows, out, texture, law)
        else:
            self._force_batch(probes.rows, *self._state(probes, deflection), out, texture, law)
        return out[0] if probes.single else out

    def jacobian(
        self,
        points: ArrayLike,
        deflection: ArrayLike | None = None,
        sliding: ArrayLike | None = None,
    ) -> FloatArray:
        """Return the exact Jacobian of the force.

        J[i, j] = ∂f_i/∂p_j, with the curvature of the surface; zero out of contact.

        Args:
            points: see :meth:`force`.
            deflection: see :meth:`force`.
            sliding: whether the anchor is dragged, shape (n,), for laws with state; the
                derivative of the deflection is then I - u uᵀ, u = d/|d|. False by default.

        Returns:
            J [N/m], shape (n, 3, 3).

        Raises:
            ParameterError: see :meth:`force`.

        Reference:
            The paper's (7), (15), (18), (20), (23); B and G, for which it has none, are exact.
        """
        return self.force_and_jacobian(points, deflection, sliding)[1]

    def force_and_jacobian(
        self,
        points: ArrayLike,
        deflection: ArrayLike | None = None,
        sliding: ArrayLike | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Return both f [N], (n, 3), and J [N/m], (n, 3, 3), for the price of :meth:`jacobian`."""
        probes = read_points("points", points, 3, "m")
        state = self._state(probes, deflection)
        if self.law.stateful:
            state = (*state, probes.truths("sliding", sliding))
        elif sliding is not None:
            raise ParameterError("sliding", f"is meaningless for law {self.law}, without state")
        forces, jacobians = np.empty((probes.count, 3)), np.empty((probes.count, 3, 3))
        self._loops.jacobian_batch(
            probes.rows, *state, forces, jacobians, self.texture.arguments, self.law_arguments
        )
        return probes.answer(forces), probes.answer(jacobians)

    @cached_property
    def _path_loops(self) -> ModuleType:
        from asperity.kernels.fuse import fuse_path

        return fuse_path(self.law, self.texture.sampler, self.acting_clamp)

    def trace(self, path: ArrayLike, memory: FloatArray | None = None) -> FloatArray:
        """Return the forces along a path, the law's state carried from point to point.

        The anchor of a law with state is set where contact begins, dragged so that the
        deflection never exceeds max_deflection, and released where contact is lost; it is
        released before the first point.

        Args:
            path: successive probe positions [m], shape (n, 3).
            memory: what a search for nearest points remembers, of
                :func:`asperity.contacts.memory.new_memory`, with the looks that a point of the path
                may take; changed. Without it every answer is exact, as that of :meth:`force`.

        Returns:
            f [N], shape (n, 3).

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        probes = array("path", path, (None, 3), "m")
        remembers = self.law.contact.remembers
        if not (self.law.stateful or remembers):
            return self.force(probes)
        kept = new_memory(UNLIMITED) if memory is None else checked_memory(memory)
        out, told = np.empty((len(probes), 3)), np.empty((len(probes), 2))
        arguments = (self.texture.arguments, self.law_arguments)
        if remembers:
            self._path_loops.path_batch(probes, out, told, kept, *arguments)
        else:
            self._loops.trace_batch(probes, out, *arguments)
        return out

    def _state(self, probes: Points, deflection: ArrayLike | None) -> tuple[Any, ...]:
        if not self.law.stateful:
            if deflection is not None:
                raise ParameterError("deflection", f"is meaningless for law {self.law}, stateless")
            return ()
        if deflection is None:
            return (np.zeros((probes.count, 2)),)
        given = probes.beside("deflection", deflection, 2, "m")
        longest = float(np.hypot(given[:, 0], given[:, 1]).max(initial=0.0))
        # Rounding of a deflection of exactly that length is forgiven.
        if longest > self.max_deflection * (1.0 + 1e-12):
            limit = f"must not be longer than max_deflection = {self.max_deflection} m"
            raise ParameterError("deflection", limit, longest)
        return (given,)
