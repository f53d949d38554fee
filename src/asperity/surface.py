"""A surface: a texture, a law and its parameters, with compiled force and Jacobian."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.contacts.warm_start import UNLIMITED, check_warm_start, new_warm_start
from asperity.core.arguments import DEFAULT_STIFFNESS, MAX_DEPTH, STIFFNESS
from asperity.core.checks import FloatArray, Points, check_array, check_points, check_positive
from asperity.core.errors import ParameterError, suggest_names
from asperity.core.files import content_digest
from asperity.derive.facts import LawFacts, clamped_facts
from asperity.frictional import Frictional
from asperity.laws import REGISTERED_LAWS, SHIPPED_LAW_ARGUMENTS, Law, find_law
from asperity.laws.clamps import CLAMPS, NONE, Clamp, find_clamp
from asperity.textures.catalogue import TextureLike, as_texture
from asperity.textures.texture import Texture

MAX_DEFAULT_DEPTH = 1e-3
"""Upper limit of the default of max_depth [m]."""

_Optional = ArrayLike | None


def default_max_depth(texture: Texture) -> float:
    """Return the peak-to-valley height of the texture, at most 1 mm [m]."""
    depth = min(texture.peak_to_valley, MAX_DEFAULT_DEPTH, texture.depth_limit)
    return depth or min(MAX_DEFAULT_DEPTH, texture.depth_limit)


def _law_parameter(name: str, text: str) -> property:
    """Return a property: the value of this law, otherwise the one that ``to_law`` passes on."""

    def value(self: Surface) -> float:
        default: Any = SHIPPED_LAW_ARGUMENTS[name].default
        return float({name: default, **self._explicit_parameters, **self.law_parameters}[name])

    return property(value, doc=text)


class Surface(Frictional):
    """A textured surface as a force field: the body is z < h(x, y), z points out of it.

    Args:
        texture: the height function, or its specification as on the command line
            ("sandpaper:grit=P60", "cloth", the path of a measured file); see
            :func:`~asperity.textures.catalogue.as_texture`.
        law: letter, name, or a user-defined :class:`~asperity.laws.Law`.
        stiffness: k [N/m] of the smooth wall.
        max_depth: D [m], the greatest intended penetration depth; it bounds the working region of
            the analysis, and clamps act there. Default: the peak-to-valley height of the texture,
            at most 1 mm.
        friction: friction coefficient μ, of a surface with a conservative law without state, 0 by
            default; of law F, 0.8.
        max_deflection: d_max [m] of law F, the greatest deflection of the anchor; default 1 mm.
        modulation_depth: a_m of law F, in [0, 1]; default 0.8.
        clamp: ``"none"`` (the law as it is), ``"whole"`` (the depth is held at max_depth),
            ``"lateral"`` (only for the lateral force, the paper's Remark 3), ``"backed"`` (whole,
            with a backing wall k (z_b - z) e_z below z_b = min h - max_depth, or -max_depth for
            laws on the nominal contact). Laws W, D, E and H are never clamped.
        continuity: c of law H, positive: its characteristic number is max(1, c); default 1.
        law_parameters: values for the parameters that the law declares, also a user-defined law;
            the keywords friction, max_deflection, modulation_depth and continuity are shorthands
            for those of the shipped laws.
        presliding_stiffness: κ [N/m] of the friction, which ``to_stiffness`` leaves unchanged;
            by default a share of the stiffness, 2/3 for law W, else 1/4.
        friction_modulation: a of the friction, in [0, 1]: its coefficient is μ (1 - a (1 + ĥ)/2),
            ĥ the height at the contact point scaled to [-1, 1]; default 0.

    A surface is immutable. Its attribute ``law_parameters`` holds all parameters of its law,
    defaults included; kernels and certificates read them from there.

    Friction is beside the force of the law, whose numbers q and q⁺ it leaves unchanged: the hand
    gains no energy from it on a closed path (docs/theory/friction.md). It acts in the plane of the
    wall, z = 0, and limits its force to μ N with N = √(2 k U), the pressing force of law W.

    A law without a potential in closed form, such as one with curl, has none: its ``friction`` is
    0, and that which is given serves the laws of ``to_law``.

    Raises:
        ParameterError: for a value that cannot be used; it names the argument.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.8e-3, period=1e-3), law="A", stiffness=500.0)
        >>> surface.force([[0.25e-3, 0.0, 0.0], [0.25e-3, 0.0, 1e-3]])
        array([[0. , 0. , 0.4],
               [0. , 0. , 0. ]])
    """

    texture: Texture
    law: Law
    stiffness: float
    max_depth: float
    clamp: str
    law_parameters: Mapping[str, float]
    _explicit_parameters: Mapping[str, float]

    def __init__(
        self,
        texture: TextureLike,
        law: str | Law = "C",
        stiffness: float = DEFAULT_STIFFNESS,
        max_depth: float | None = None,
        friction: float | None = None,
        max_deflection: float | None = None,
        modulation_depth: float | None = None,
        clamp: str = NONE.name,
        continuity: float | None = None,
        law_parameters: Mapping[str, float] | None = None,
        presliding_stiffness: float | None = None,
        friction_modulation: float | None = None,
    ) -> None:
        law = find_law(law)
        texture = as_texture(texture)
        if max_depth is None:
            max_depth = default_max_depth(texture)
        values = {
            "friction": friction,
            "max_deflection": max_deflection,
            "modulation_depth": modulation_depth,
            "continuity": continuity,
            "presliding_stiffness": presliding_stiffness,
            "friction_modulation": friction_modulation,
        }
        keywords = {
            name: SHIPPED_LAW_ARGUMENTS[name].validate(value)
            for name, value in values.items()
            if value is not None
        }
        named = law.check_parameters(law_parameters or {})
        for name in keywords.keys() & named.keys():
            reason = "is given twice, by keyword and in law_parameters"
            raise ParameterError(name, reason, named[name])
        self.__setstate__(
            {
                "texture": texture,
                "law": law,
                "stiffness": STIFFNESS.validate(stiffness),
                "max_depth": MAX_DEPTH.validate(max_depth),
                "clamp": find_clamp(clamp).name,
                "_explicit_parameters": keywords | named,
            }
        )
        self._check_friction()

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle; a registered law is stored as its letter.

        The process that unpickles a user-defined law must have registered it.
        """
        names = ("texture", "law", "stiffness", "max_depth", "clamp", "_explicit_parameters")
        state = {name: getattr(self, name) for name in names}
        if REGISTERED_LAWS.get(self.law.letter) is self.law:
            state["law"] = self.law.letter
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Set all attributes; parameters that are not given get the defaults of the law."""
        law = find_law(state["law"])
        parameters = {name: float(value) for name, value in law.parameters.items()}
        for name, value in state["_explicit_parameters"].items():
            if name in parameters:
                parameters[name] = law.arguments[name].validate(value)
        if law.stateful and "max_deflection" in parameters:  # the derivation requires it
            check_positive("max_deflection", parameters["max_deflection"], "m")
        texture = state["texture"]
        texture.check_law(law.contact, parameters)
        if state["max_depth"] > texture.depth_limit:
            raise ParameterError(
                "max_depth",
                f"must be at most {texture.depth_limit:.9g} m, the depth of the baked field",
                state["max_depth"],
            )
        vars(self).update(state, law=law, law_parameters=MappingProxyType(parameters))

    def _replace(self, **values: Any) -> Surface:
        """Return a copy with other values; derived attributes are computed again."""
        result = object.__new__(type(self))
        result.__setstate__(self.__getstate__() | {"law": self.law} | values)
        return result

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(
            f"Surface is immutable, cannot set {name}: use to_law, to_stiffness, to_depth, "
            "to_texture or Surface(...)"
        )

    __delattr__ = None  # type: ignore[assignment]  # immutable

    def __repr__(self) -> str:
        return (
            f"Surface({self.texture!r}, law={self.law.letter!r}, stiffness={self.stiffness!r}, "
            f"max_depth={self.max_depth!r}, clamp={self.clamp!r})"
        )

    def to_depth(self, max_depth: float) -> Surface:
        """Return a copy with another max_depth [m], which must be positive."""
        return self._replace(max_depth=MAX_DEPTH.validate(max_depth))

    def to_texture(self, texture: TextureLike, max_depth: float | None = None) -> Surface:
        """Return a copy with another texture.

        Args:
            texture: the texture, or a text or path that names it.
            max_depth: [m], positive; unchanged by default.
        """
        depth = self.max_depth if max_depth is None else MAX_DEPTH.validate(max_depth)
        return self._replace(texture=as_texture(texture), max_depth=depth)

    def to_stiffness(self, stiffness: float) -> Surface:
        """Return a copy with another stiffness [N/m], which must be positive."""
        return self._replace(stiffness=STIFFNESS.validate(stiffness))

    def to_law(self, law: str | Law, law_parameters: Mapping[str, float] | None = None) -> Surface:
        """Return a copy with another law.

        Parameter values given for this surface are passed on, also those that only the other law
        declares.

        Args:
            law: the other law.
            law_parameters: further values for the parameters that it declares.

        Raises:
            ParameterError: for an unknown law, or a value that cannot be used.
        """
        other = find_law(law)
        parameters = {**self._explicit_parameters, **other.check_parameters(law_parameters or {})}
        return self._replace(law=other, _explicit_parameters=parameters)

    def parameter(self, name: str) -> float:
        """Return the value of a parameter of the law.

        Raises:
            ParameterError: for a name that the law does not declare.
        """
        if name not in self.law_parameters:
            hint = suggest_names(name, self.law_parameters) if self.law_parameters else "none"
            raise ParameterError("name", f"is no parameter of law {self.law}: {name!r}; {hint}")
        return self.law_parameters[name]

    max_deflection = _law_parameter("max_deflection", "d_max [m] of law F.")
    modulation_depth = _law_parameter("modulation_depth", "a_m [1] of law F.")
    continuity = _law_parameter("continuity", "c [1] of law H.")

    @property
    def effective_clamp(self) -> Clamp:
        """The clamp that acts on the force; ``NONE`` for a law that is never clamped."""
        return CLAMPS[self.clamp] if self.law.clampable else NONE

    @property
    def facts(self) -> LawFacts:
        """Symbolic facts about the clamped law."""
        return clamped_facts(self.law, self.effective_clamp)

    @property
    def depends_on_texture(self) -> bool:
        """Whether the force depends on the texture; that of the smooth wall does not."""
        return self.law.contact.begins_on_texture or self.facts.depends_on_surface

    @property
    def clamped_depth(self) -> float:
        """Depth [m] at which the probe is below z_b everywhere; max_depth without a clamp.

        Statements about a clamped field hold at least down to this depth. Where a clamp holds only
        a part of the force it is max_depth below the lowest point of the texture, whatever the
        contact: the other part changes further with depth.
        """
        clamp = self.effective_clamp
        if not clamp.changes_force:
            return self.max_depth
        whole = clamp.holds_whole_force
        texture = self.texture
        low, high = self.law.contact.extremes(texture) if whole else texture.extremes
        return self.max_depth + (high - low)

    @property
    def floor(self) -> float:
        """z_b [m], below which ``clamp="backed"`` adds its wall."""
        return self.law.contact.extremes(self.texture)[0] - self.max_depth

    @cached_property
    def law_arguments(self) -> tuple[float, ...]:
        """Arguments of the law's kernels: see ``asperity.kernels.probe_functions``."""
        from asperity.kernels.fuse import kernel_source

        # The extremes of a map take time to compute: only for laws that use the relative height.
        relative = "h_mid" in kernel_source(self.law)
        low, high = self.texture.extremes if relative else (-1.0, 1.0)
        return (
            self.stiffness,
            0.5 * (low + high),
            0.5 * (high - low) or 1.0,  # a flat texture modulates nothing
            self.max_depth,
            self.floor if CLAMPS[self.clamp].has_backing_wall else 0.0,
            *self.law_parameters.values(),
        )

    @property
    def digest(self) -> str:
        """Digest of everything that the force depends on: texture, law, parameters and clamp."""
        from asperity.kernels.fuse import kernel_source

        texture = type(self.texture.arguments).__name__, *map(np.asarray, self.texture.arguments)
        law = self.law.letter, kernel_source(self.law), self.effective_clamp.name
        return content_digest(texture, law, np.array(self.loop_arguments))[:16]

    @cached_property
    def _loops(self) -> ModuleType:
        from asperity.kernels.fuse import fuse_surface

        return fuse_surface(self.law, self.texture.sampler, self.effective_clamp)

    def force(self, points: ArrayLike, deflection: ArrayLike | None = None) -> FloatArray:
        """Return the force on the probe, which the device applies to the hand.

        Args:
            points: probe positions p [m], shape (n, 3), or (3,) for one; other arguments and the
                result then lack the first axis too.
            deflection: tangential deflection d of the anchor [m], shape (n, 2), for laws with
                state, or with friction, which limits it; (n, 3) for friction on a closed body;
                zero by default.

        Returns:
            f [N], shape (n, 3); zero out of contact.

        Raises:
            ParameterError: for another shape, values that are not finite, a deflection longer
                than max_deflection, or a deflection without state and friction.

        Reference:
            The paper's Table I, with the corrections named in each law.
        """
        probes = check_points("points", points, 3, "m")
        if deflection is not None and self.contact_friction is not None:
            axes = self.contact_friction.axes
            deflections = probes.check_array_per_point("deflection", deflection, axes, "m")
            return probes.restore_shape(self._deflected_force(probes.rows, deflections))
        out = np.empty(probes.rows.shape)
        state = self._anchor_state(probes, deflection)
        self._loops.force_batch(
            probes.rows, *state, out, self.texture.arguments, self.law_arguments
        )
        return probes.restore_shape(out)

    def jacobian(
        self, points: ArrayLike, deflection: _Optional = None, sliding: _Optional = None
    ) -> FloatArray:
        """Return the exact Jacobian of the force.

        J[i, j] = ∂f_i/∂p_j, with the curvature of the surface; zero out of contact.

        Args:
            points: see :meth:`force`.
            deflection: see :meth:`force`.
            sliding: whether the anchor slides, shape (n,), for laws with state; the derivative of
                the deflection is then I - u uᵀ, u = d/|d|. With friction, whether its force is at
                the slip limit. False by default. With neither, friction is left out.

        Returns:
            J [N/m], shape (n, 3, 3).

        Raises:
            ParameterError: see :meth:`force`.

        Reference:
            The paper's (7), (15), (18), (20), (23); it has none for B and G.
        """
        return self.force_and_jacobian(points, deflection, sliding)[1]

    def force_and_jacobian(
        self, points: ArrayLike, deflection: _Optional = None, sliding: _Optional = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return f [N], (n, 3), and J [N/m], (n, 3, 3), at the cost of :meth:`jacobian` alone."""
        probes = check_points("points", points, 3, "m")
        has_state = deflection is not None or sliding is not None
        if has_state and self.contact_friction is not None:
            return self._with_friction(self.contact_friction, probes, deflection, sliding)
        state = self._anchor_state(probes, deflection)
        if self.law.stateful:
            state = (*state, probes.check_flags_per_point("sliding", sliding))
        elif sliding is not None:
            raise ParameterError("sliding", f"is meaningless for law {self.law}, without state")
        forces = np.empty((probes.count, 3))
        jacobians = np.empty((probes.count, 3, 3))
        self._loops.jacobian_batch(
            probes.rows, *state, forces, jacobians, self.texture.arguments, self.law_arguments
        )
        return probes.restore_shape(forces), probes.restore_shape(jacobians)

    @cached_property
    def _path_loops(self) -> ModuleType:
        from asperity.kernels.fuse import fuse_path

        has_friction = self.contact_friction is not None
        return fuse_path(self.law, self.texture.sampler, self.effective_clamp, has_friction)

    def trace(self, path: ArrayLike, warm_start: FloatArray | None = None) -> FloatArray:
        """Return the forces along a path, with the state of the law propagated along it.

        The anchor of a law with state is set where contact begins, slides so that the deflection
        never exceeds max_deflection, and is released where contact ends. It is released before the
        first point. The anchor of friction is at the first point, and slides so that its force
        never exceeds the slip limit, which is 0 out of contact.

        Args:
            path: successive probe positions [m], shape (n, 3).
            warm_start: warm start of the closest-point search, with its evaluation budget per
                point, from :func:`asperity.contacts.warm_start.new_warm_start`; updated in place.
                By default every search is exact, as in :meth:`force`.

        Returns:
            f [N], shape (n, 3).

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        probes = check_array("path", path, (None, 3), "m")
        has_state = self.law.stateful or self.contact_friction is not None
        if not (has_state or self.law.contact.has_warm_start):
            return self.force(probes)
        state = new_warm_start(UNLIMITED) if warm_start is None else check_warm_start(warm_start)
        out = np.empty((len(probes), 3))
        diagnostics = np.empty((len(probes), 2))
        arguments = (self.texture.arguments, self.loop_arguments)
        self._path_loops.path_batch(probes, out, diagnostics, state, *arguments)
        return out

    def _anchor_state(self, probes: Points, deflection: ArrayLike | None) -> tuple[Any, ...]:
        if not self.law.stateful:
            if deflection is not None:
                raise ParameterError("deflection", f"is meaningless for law {self.law}, stateless")
            return ()
        if deflection is None:
            return (np.zeros((probes.count, 2)),)
        deflections = probes.check_array_per_point("deflection", deflection, 2, "m")
        longest = float(np.hypot(*deflections.T).max(initial=0.0))
        # Tolerate the rounding of a deflection of exactly that length.
        if longest > self.max_deflection * (1.0 + 1e-12):
            raise ParameterError(
                "deflection",
                f"must not be longer than max_deflection = {self.max_deflection} m",
                longest,
            )
        return (deflections,)


SURFACE_KEYWORDS = frozenset(inspect.signature(Surface).parameters) - {"texture"}
"""Keywords of :class:`Surface` that an analysis passes on."""
