"""What stands on the stage of the lab: surface, device and hand, and what may be changed of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from asperity.arguments import STIFFNESS
from asperity.checks import real
from asperity.devices import Device, changed_device, load_device
from asperity.errors import ParameterError
from asperity.laws import find_law
from asperity.scene.alone import with_mass
from asperity.scene.loading import Scene, load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.servo.safety import Safety
from asperity.simulation import Servo, SpringHand
from asperity.textures.drawn import prepare_texture
from asperity.textures.naming import KINDS, specified
from asperity.textures.texture import Texture

SURFACE = "sinusoid:amplitude=0.2mm,period=2mm"
"""Shown if nothing is asked for."""
DEVICE = "touch-x"
LAW = "C"
_START_STIFFNESS = 250.0  # [N/m]
# One that moves to and fro with a pointer; what a scene says of its hand comes before it.
_HAND = {"kind": "spring", "stiffness": "800 N/m", "damping": "5 N*s/m", "mass": "50 g"}
_STILL = {"kind": "still", "point": [0, 0, 0]}
# Nobody is harmed by a simulated device: a machine that is busy does not end the loop.
_PATIENT = {"misses": 10**9, "lateness": 60.0, "silence": 10.0, "ramp": 0.1}

MOST_DELAY = 100
RANGES: dict[str, tuple[float, float]] = {
    "stiffness": (1.0, 20_000.0), "max_depth": (1e-5, 5e-3), "delay": (0, MOST_DELAY),
    "hand_stiffness": (10.0, 3000.0), "hand_damping": (0.0, 30.0),
    "magnify": (0.01, 1000.0), "magnify_height": (0.01, 1000.0),
}  # fmt: skip
"""Least and greatest of what the page may ask for [SI]."""
_SIMULATED = ("device", "delay", "hand_stiffness", "hand_damping")
_FIRST = ("law", "magnify")  # others rest on them: a law has parameters, heights grow with the size


@dataclass(frozen=True)
class Stage:
    """What is shown.

    Attributes:
        setup: surface, plant, hand, servo and limits of the loop.
        named: what the surface was asked for by.
        plain: its texture, before it is magnified here.
        magnified: factors of its size and of its height.
        first: name and plain texture at the start, which may be of a file.
        told: of the preparation of that file, by name [SI].
        code: files of the user's own that it takes, by name.
        own: what the catalogue says of steps and delay of a real device, which has them itself.
    """

    setup: Setup
    named: str
    plain: Texture
    first: tuple[str, Texture]
    magnified: tuple[float, float] = (1.0, 1.0)
    told: Mapping[str, Any] = field(default_factory=dict)
    code: Mapping[str, bytes] = field(default_factory=dict)
    own: Servo | None = None

    def changed(self, wishes: Mapping[str, Any]) -> Stage:
        """Return the stage with some things changed.

        Args:
            wishes: by name: ``law`` (its letter), ``texture`` (a kind with its arguments, never a
                file but that of the start), ``device`` (of the catalogue), those of ``RANGES``, and
                the parameters of the law.

        Raises:
            ParameterError: for an unknown name or a value that cannot be.
        """
        stage = self
        for name, value in sorted(wishes.items(), key=lambda wish: wish[0] not in _FIRST):
            if self.own is not None and name in _SIMULATED:
                raise ParameterError(name, "is that of the real device, and of who holds it")
            change = _CHANGES.get(name)
            if change is not None:
                stage = change(stage, within(name, value) if name in RANGES else str(value))
                continue
            law = stage.setup.surface.law
            if name not in law.arguments:
                known = ", ".join((*_CHANGES, *law.arguments))
                raise ParameterError(name, f"cannot be changed; {known} can")
            surface = stage.setup.surface.to_law(law, {name: real(name, value)})
            stage = replace(stage, setup=replace(stage.setup, surface=surface))
        return stage

    @property
    def settings(self) -> dict[str, Any]:
        """What is shown, by the names of ``changed``."""
        setup = self.setup
        hand = setup.hand if isinstance(setup.hand, SpringHand) else None
        return {
            "texture": self.named, "law": setup.surface.law.letter,
            "stiffness": setup.surface.stiffness, "max_depth": setup.surface.max_depth,
            "device": setup.device.id, "delay": self.electronics.delay,
            "hand_stiffness": hand and hand.stiffness[0],
            "hand_damping": hand and hand.damping[0],
            "magnify": self.magnified[0], "magnify_height": self.magnified[1],
            **setup.surface.law_parameters,
        }  # fmt: skip

    @property
    def electronics(self) -> Servo:
        """Steps and delay, which are the loop's on the simulated device."""
        return self.own or self.setup.servo

    @property
    def judged(self) -> Device:
        """The device on which the limit counts, with the delay that was chosen."""
        device, delay = self.setup.device, self.setup.servo.delay
        if self.own is not None or delay == (device.value("delay_samples") or 0):
            return device
        words = {"value": float(delay), "unit": "1", "source": "chosen in the lab"}
        return changed_device(device, {"delay_samples": words})

    @property
    def middle(self) -> tuple[float, float]:
        """Where the hand is at first [m]: in the middle of a surface that ends."""
        texture = self.setup.surface.texture
        if not texture.ends:
            return 0.0, 0.0
        x, y = texture.domain.origin + 0.5 * texture.domain.spans.sum(axis=0)
        return float(x), float(y)

    def restarts(self, other: Stage) -> bool:
        """Whether going to another stage takes another loop: device, hand or delay differ."""
        return any(
            getattr(self.setup, part) is not getattr(other.setup, part)
            for part in ("device", "hand", "servo", "plant")
        )


def within(name: str, value: object) -> float:
    """Return a number that lies in its range.

    Raises:
        ParameterError: for another value.
    """
    least, most = RANGES[name]
    number = real(name, value)
    if not least <= number <= most:
        raise ParameterError(name, f"must be {least:g} to {most:g}", value)
    return number


def _with_law(stage: Stage, letter: str) -> Stage:
    return replace(stage, setup=stage.setup.with_law(find_law(letter)))


def _with_stiffness(stage: Stage, stiffness: float) -> Stage:
    surface = stage.setup.surface.to_stiffness(stiffness)
    return replace(stage, setup=replace(stage.setup, surface=surface))


def _with_depth(stage: Stage, depth: float) -> Stage:
    surface = stage.setup.surface.to_depth(depth)
    return replace(stage, setup=replace(stage.setup, surface=surface))


def _with_texture(stage: Stage, text: str) -> Stage:
    if text == stage.first[0]:
        return _shown(replace(stage, named=text, plain=stage.first[1]))
    named = specified(text)
    if named is None or any(argument.name == "path" for argument in KINDS[named[0]].arguments):
        raise ParameterError("texture", "must be a kind: files are named at the start alone", text)
    return _shown(replace(stage, named=text, plain=load_scene(text).texture))


def _shown(stage: Stage) -> Stage:
    """Return the stage with its texture magnified."""
    size, height = stage.magnified
    texture = stage.plain
    if not size == height == 1.0:
        texture = prepare_texture(texture, magnify=size, magnify_height=height)
    return replace(
        stage, setup=replace(stage.setup, surface=stage.setup.surface.to_texture(texture))
    )


def _with_device(stage: Stage, name: str) -> Stage:
    if name.lower().endswith(".toml"):
        raise ParameterError("device", "must be one of the catalogue here", name)
    settings = stage.settings
    made = _made(Scene(stage.setup.surface.texture), load_device(name), stage.named)
    setup = replace(made.setup, surface=stage.setup.surface, hand=stage.setup.hand)
    return _with_delay(replace(stage, setup=setup), settings["delay"])


def _with_delay(stage: Stage, delay: float) -> Stage:
    return replace(stage, setup=stage.setup.with_delay(round(delay)))


def _spring(stage: Stage) -> SpringHand:
    if isinstance(stage.setup.hand, SpringHand):
        return stage.setup.hand
    raise ParameterError("hand", "is an elastic band, which has its own numbers")


def _with_hand(stage: Stage, **values: float) -> Stage:
    return replace(stage, setup=replace(stage.setup, hand=replace_hand(_spring(stage), **values)))


def replace_hand(hand: SpringHand, **values: Any) -> SpringHand:
    """Return a hand with other numbers."""
    kept = {name: getattr(hand, name) for name in ("stiffness", "damping", "mass", "force")}
    return SpringHand(**{**kept, **values})


_CHANGES: dict[str, Any] = {
    "texture": _with_texture,
    "device": _with_device,
    "delay": _with_delay,
    "law": _with_law,
    "stiffness": _with_stiffness,
    "max_depth": _with_depth,
    "magnify": lambda stage, value: _shown(replace(stage, magnified=(value, value))),
    "magnify_height": lambda stage, value: _shown(
        replace(stage, magnified=(stage.magnified[0], value))
    ),
    "hand_stiffness": lambda stage, value: _with_hand(stage, stiffness=value),
    "hand_damping": lambda stage, value: _with_hand(stage, damping=value),
}


def make_stage(
    scene: Scene, named: str = SURFACE, surface: Mapping[str, Any] | None = None,
    device: Device | None = None, told: Mapping[str, Any] | None = None,
) -> Stage:  # fmt: skip
    """Return what the lab shows at first.

    Args:
        scene: a scene, or a surface alone.
        named: by which it was asked for.
        surface: arguments of the surface that come before the scene's.
        device: comes before the scene's.
        told: of the preparation of the texture, by name [SI].

    Raises:
        ParameterError: for what cannot be simulated.
    """
    made = _made(scene, device or scene.device or load_device(DEVICE), named, surface)
    return replace(made, told=dict(told or {}))


def held_stage(setup: Setup, own: Servo, named: str, told: Mapping[str, Any]) -> Stage:
    """Return what the lab shows on a device that somebody holds.

    Args:
        setup: of the loop.
        own: what the catalogue says of the electronics.
        named: by which the surface was asked for.
        told: of the preparation of the texture, by name [SI].
    """
    texture = setup.surface.texture
    return Stage(setup, named, texture, (named, texture), told=dict(told), own=own)


def _made(
    scene: Scene, device: Device, named: str, surface: Mapping[str, Any] | None = None
) -> Stage:
    first = {"law": find_law(LAW), STIFFNESS.name: _START_STIFFNESS, "clamp": "backed"}
    own = {**scene.surface, **(surface or {})}
    hand = scene.loop.get("hand", _HAND)
    if hand.get("kind") == "moved":
        hand = _HAND
    # It runs until somebody ends it.
    run = {**scene.loop.get("run", {}), "duration": "1 s"}
    loop = {**scene.loop, "hand": hand, "motion": _STILL, "run": run}
    complete, said = with_mass(device)
    setup = make_setup(replace(scene, loop=loop), surface={**first, **own}, device=complete)
    guards = {**vars(Safety()), **_PATIENT, "beyond_depth": "warn"}
    setup = replace(setup, safety=Safety(**guards), assumptions=(*said, *setup.assumptions))
    return Stage(setup, named, scene.texture, (named, scene.texture))
