"""Scene of the lab: surface, device and hand, their permitted changes, and saved scenes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from asperity.analysis.results.compare import DEFAULT_DEVICE
from asperity.core.arguments import STIFFNESS
from asperity.core.checks import check_real
from asperity.core.errors import ParameterError
from asperity.devices import Device, load_device, override_device
from asperity.laws import find_law
from asperity.scene.scene_defaults import with_assumed_mass
from asperity.scene.scene_file import Scene, load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.servo.safety import Safety
from asperity.simulation import Servo
from asperity.surface import Surface
from asperity.textures.catalogue import KINDS, parse_specification
from asperity.textures.kinds.prepare_synthetic import prepare_texture
from asperity.textures.texture import Texture

DEFAULT_SURFACE = "sinusoid:amplitude=0.2mm,period=2mm"
START_LAW = "C"
START_STIFFNESS = 250.0
"""Initial stiffness without a scene [N/m]."""
# Follows a pointer; the hand of a scene file takes precedence.
_DEFAULT_HAND = {"kind": "spring", "stiffness": "800 N/m", "damping": "5 N*s/m", "mass": "50 g"}
_STILL_MOTION = {"kind": "still", "point": [0, 0, 0]}
# A simulated device is harmless: late samples do not end its loop.
_RELAXED_GUARDS = Safety(ramp=0.1, lateness=60.0, silence=10.0, beyond_depth="warn")

MAX_DELAY = 100
RANGES: dict[str, tuple[float, float]] = {
    "stiffness": (1.0, 20_000.0),
    "max_depth": (1e-5, 5e-3),
    "friction": (0.0, 2.0),
    "delay": (0, MAX_DELAY),
    "hand_stiffness": (10.0, 3000.0),
    "hand_damping": (0.0, 30.0),
    "magnify": (0.01, 1000.0),
    "magnify_height": (0.01, 1000.0),
}
"""Least and greatest values that the page may request [SI]."""
_SIMULATED_ONLY = ("device", "delay", "hand_stiffness", "hand_damping")
# Applied before changes that depend on them: parameters of the law, and the height.
_APPLIED_FIRST = ("law", "magnify")


@dataclass(frozen=True)
class SceneState:
    """Surface, device and hand of the lab.

    Attributes:
        setup: surface, plant, hand, servo and limits of the loop.
        source: specification or path of the surface.
        base_texture: its texture without the magnification.
        magnification: factors of its size and of its height.
        initial_texture: source and texture at the start, which may be of a file.
        device_servo: steps and delay of a real device by the catalogue; the loop adds neither.
    """

    setup: Setup
    source: str
    base_texture: Texture
    initial_texture: tuple[str, Texture]
    magnification: tuple[float, float] = (1.0, 1.0)
    device_servo: Servo | None = None

    def with_changes(self, changes: Mapping[str, Any]) -> SceneState:
        """Return a scene with changes applied.

        Args:
            changes: by name: ``law`` (its letter), ``texture`` (a kind with its arguments, or the
                initial source), ``device`` (of the catalogue), those of ``RANGES``, and the
                parameters of the law.

        Raises:
            ParameterError: for an unknown name or an invalid value.
        """
        state = self
        for name, value in sorted(changes.items(), key=lambda item: item[0] not in _APPLIED_FIRST):
            if self.device_servo is not None and name in _SIMULATED_ONLY:
                raise ParameterError(name, "is given by the real device and its user")
            setter = _SETTERS.get(name)
            surface = state.setup.surface
            if setter is not None:
                state = setter(state, check_range(name, value) if name in RANGES else str(value))
            elif name in surface.law.arguments:
                parameters = {name: check_real(name, value)}
                state = _with_surface(state, surface.to_law(surface.law, parameters))
            else:
                known = ", ".join((*_SETTERS, *surface.law.arguments))
                raise ParameterError(name, f"cannot be changed; {known} can")
        return state

    @property
    def settings(self) -> dict[str, Any]:
        """Current values, by the names of :meth:`with_changes`."""
        setup = self.setup
        return {
            "texture": self.source,
            "law": setup.surface.law.letter,
            "stiffness": setup.surface.stiffness,
            "max_depth": setup.surface.max_depth,
            "device": setup.device.id,
            "delay": self.electronics.delay,
            **setup.hand.settings,
            "magnify": self.magnification[0],
            "magnify_height": self.magnification[1],
            "friction": setup.surface.friction,
            **setup.surface.law_parameters,
        }

    @property
    def electronics(self) -> Servo:
        """Steps and delay: those of the loop on a simulated device."""
        return self.device_servo or self.setup.servo

    @property
    def rated_device(self) -> Device:
        """The device of the stability limit, with the chosen delay."""
        device = self.setup.device
        delay = self.setup.servo.delay
        if self.device_servo is not None or delay == (device.value("delay_samples") or 0):
            return device
        datum = {"value": float(delay), "unit": "1", "source": "chosen in the lab"}
        return override_device(device, {"delay_samples": datum})

    @property
    def centre(self) -> tuple[float, float]:
        """Initial position of the hand [m]: the middle of a finite surface."""
        texture = self.setup.surface.texture
        if not texture.is_mirrored:
            return 0.0, 0.0
        x, y = texture.domain.origin + 0.5 * texture.domain.spans.sum(axis=0)
        return float(x), float(y)

    def needs_restart(self, other: SceneState) -> bool:
        """Whether another scene needs a new loop: device, hand or delay differ."""
        return any(
            getattr(self.setup, part) is not getattr(other.setup, part)
            for part in ("device", "hand", "servo", "plant")
        )


def check_range(name: str, value: object) -> float:
    """Return a number after checking its range.

    Raises:
        ParameterError: for a value out of range.
    """
    lowest, highest = RANGES[name]
    number = check_real(name, value)
    if not lowest <= number <= highest:
        raise ParameterError(name, f"must be {lowest:g} to {highest:g}", value)
    return number


def _with_surface(state: SceneState, surface: Surface) -> SceneState:
    return replace(state, setup=replace(state.setup, surface=surface))


def _with_texture(state: SceneState, text: str) -> SceneState:
    if text == state.initial_texture[0]:
        texture = state.initial_texture[1]
        return _apply_magnification(replace(state, source=text, base_texture=texture))
    named = parse_specification(text)
    if named is None or any(argument.name == "path" for argument in KINDS[named[0]].arguments):
        raise ParameterError("texture", "must be a kind: files are opened at the start", text)
    return _apply_magnification(replace(state, source=text, base_texture=load_scene(text).texture))


def _apply_magnification(state: SceneState, *factors: float) -> SceneState:
    """Return the scene with its texture magnified, by new factors if there are any."""
    size, height = factors or state.magnification
    texture = state.base_texture
    state = replace(state, magnification=(size, height))
    if not size == height == 1.0:
        texture = prepare_texture(texture, magnify=size, magnify_height=height)
    return _with_surface(state, state.setup.surface.to_texture(texture))


def _with_device(state: SceneState, name: str) -> SceneState:
    if name.lower().endswith(".toml"):
        raise ParameterError("device", "must be a device of the catalogue", name)
    delay = state.electronics.delay
    surface = state.setup.surface
    scene = make_scene_state(Scene(surface.texture), state.source, device=load_device(name))
    setup = replace(scene.setup, surface=surface, hand=state.setup.hand)
    return _with_delay(replace(state, setup=setup), delay)


def _with_delay(state: SceneState, delay: float) -> SceneState:
    return replace(state, setup=state.setup.with_delay(round(delay)))


def _with_hand(state: SceneState, **values: float) -> SceneState:
    return replace(state, setup=replace(state.setup, hand=state.setup.hand.with_values(**values)))


_SETTERS: dict[str, Any] = {
    "texture": _with_texture,
    "device": _with_device,
    "delay": _with_delay,
    "law": lambda state, law: replace(state, setup=state.setup.with_law(find_law(law))),
    "stiffness": lambda state, value: _with_surface(state, state.setup.surface.to_stiffness(value)),
    "friction": lambda state, value: _with_surface(state, state.setup.surface.to_friction(value)),
    "max_depth": lambda state, value: _with_surface(state, state.setup.surface.to_depth(value)),
    "magnify": lambda state, value: _apply_magnification(state, value, value),
    "magnify_height": lambda state, value: _apply_magnification(
        state, state.magnification[0], value
    ),
    "hand_stiffness": lambda state, value: _with_hand(state, stiffness=value),
    "hand_damping": lambda state, value: _with_hand(state, damping=value),
}


def make_scene_state(
    scene: Scene,
    source: str = DEFAULT_SURFACE,
    surface: Mapping[str, Any] | None = None,
    device: Device | None = None,
) -> SceneState:
    """Return the initial scene of the lab.

    Args:
        scene: a scene, or a texture alone.
        source: its specification or path.
        surface: arguments of the surface that override the scene's.
        device: overrides the scene's.

    Raises:
        ParameterError: for a scene that cannot be simulated.
    """
    defaults = {"law": find_law(START_LAW), STIFFNESS.name: START_STIFFNESS, "clamp": "backed"}
    hand = scene.loop.get("hand", _DEFAULT_HAND)
    if hand.get("kind") == "moved":
        hand = _DEFAULT_HAND
    run = {**scene.loop.get("run", {}), "duration": "1 s"}  # required, and not used
    loop = {**scene.loop, "hand": hand, "motion": _STILL_MOTION, "run": run}
    used = device or scene.device or load_device(DEFAULT_DEVICE)
    complete, assumed = with_assumed_mass(used)
    arguments = {**defaults, **scene.surface, **(surface or {})}
    setup = make_setup(replace(scene, loop=loop), surface=arguments, device=complete)
    assumptions = (*assumed, *setup.assumptions)
    setup = replace(setup, safety=_RELAXED_GUARDS, assumptions=assumptions)
    return SceneState(setup, source, scene.texture, (source, scene.texture))


def make_device_scene_state(setup: Setup, device_servo: Servo, source: str) -> SceneState:
    """Return the initial scene on a real device.

    Args:
        setup: of the loop.
        device_servo: steps and delay of the device by the catalogue.
        source: specification or path of the surface.
    """
    texture = setup.surface.texture
    return SceneState(setup, source, texture, (source, texture), device_servo=device_servo)


SCENE_KEY = "saved_scene"
"""Name of the change to a saved scene; other changes are applied to that scene."""
TOUR_SCENE = "tour"
PREVIOUS_SCENE = "previous"
"""The first scene of the guided tour, and the scene before the tour."""


class SavedScenes:
    """Scenes by name.

    Attributes:
        scenes: the scenes.
    """

    def __init__(self) -> None:
        self.scenes: dict[str, SceneState] = {}

    def apply_changes(self, scene_state: SceneState, changes: Mapping[str, Any]) -> SceneState:
        """Return the requested scene; see :meth:`SceneState.with_changes`.

        Args:
            scene_state: the current scene.
            changes: by name; ``SCENE_KEY`` is the name of a saved scene.

        Raises:
            ParameterError: for an unknown scene or an invalid change.
        """
        others = dict(changes)
        name = others.pop(SCENE_KEY, None)
        start = scene_state if name is None else self._find_scene(scene_state, str(name))
        return start.with_changes(others)

    def _find_scene(self, scene_state: SceneState, name: str) -> SceneState:
        if name == TOUR_SCENE:
            self.scenes.setdefault(PREVIOUS_SCENE, scene_state)
            return make_scene_state(load_scene(DEFAULT_SURFACE))
        if name == PREVIOUS_SCENE:
            return self.scenes.pop(name, scene_state)
        if name not in self.scenes:
            raise ParameterError(SCENE_KEY, "is not stored", name)
        return self.scenes[name]
