"""Whoever does anything at all to the page: pointer, keys, wheel, fingers, and every control."""

from __future__ import annotations

import json
import random

from tests.lab.browser import Browser

KEYS = (
    *"wabcdefghxmrstnpv2+- ",
    "ArrowLeft",
    "ArrowRight",
    "ArrowUp",
    "ArrowDown",
    "PageUp",
    "PageDown",
    "Tab",
    "Enter",
    "Escape",
)
TEXTS = (
    "sinusoid:amplitude=0.2mm,period=2mm",
    "grating:height=100um,period=3mm",
    "velvet",
    "",
    "/etc/passwd",
    "sinusoid:amplitude=-1mm,period=2mm",
    "1e3",
    "-5",
    "0",
    "NaN",
)
SIZES = ((1280, 900), (360, 700), (1920, 1080))
# What is there to be used, and a control that is used: clicked, or given one of the values.
_SEEN = """[...document.querySelectorAll("button, summary, select, input")]
  .map((one, k) => [one, k])
  .filter(([one]) => one.checkVisibility() && !one.disabled).map(([, k]) => k)"""
_USE = """((k, share, text) => {
  const one = document.querySelectorAll("button, summary, select, input")[k];
  if (one.matches("button, summary")) { one.click(); return; }
  if (one.matches("select")) one.selectedIndex = Math.floor(share * one.options.length);
  else if (one.type === "range") one.value = +one.min + share * (one.max - one.min);
  else one.value = text;
  one.dispatchEvent(new Event("input"));
  one.dispatchEvent(new Event("change"));
})"""
# Frames that are beyond the greatest force of the device: of this loop, or of the one before.
_WATCH = """lab.most = lab.beyond = 0; lab.bounds = [0, 0];
  lab.watch = setInterval(() => {
    const { frame, status } = lab;
    if (!frame || !status) return;
    if (lab.bounds[1] !== status.max_force) lab.bounds = [lab.bounds[1], status.max_force];
    for (const k of [7, 8, 9]) lab.most = Math.max(lab.most, frame.maxima[k], -frame.minima[k]);
    if (lab.most > Math.max(...lab.bounds) * (1 + 1e-9)) lab.beyond++;
  }, 4); 0"""


class Monkey:
    """Does things to a page at random.

    Args:
        page: the page.
    """

    def __init__(self, page: Browser) -> None:
        self.page, self._chance = page, random.Random(7)
        page.ask(_WATCH)

    def act(self) -> None:
        """Do one thing."""
        acts = {
            self._key: 25,
            self._move: 25,
            self._press: 10,
            self._wheel: 8,
            self._touch: 7,
            self._control: 23,
            self._resize: 2,
        }
        act = self._chance.choices(list(acts), list(acts.values()))[0]
        act()

    def end(self) -> tuple[int, int, float]:
        """Return errors in the page, frames beyond the greatest force, and the greatest [N]."""
        page = self.page
        page.resize(*SIZES[0])
        page.ask("lab.tour.isActive && lab.tour.end(), 0")
        page.until("lab.status?.state == 'running'")
        frames = page.ask("lab.frame.number")
        page.until(f"lab.frame.number > {frames}")
        page.ask("clearInterval(lab.watch)")
        beyond, most, faults = page.ask("[lab.beyond, lab.most, lab.errorCount]")
        return faults + len(page.said), beyond, most

    def _place(self) -> tuple[float, float]:
        name = self._chance.choice(["relief", "section"])
        box = self.page.ask(f"document.getElementById('{name}').getBoundingClientRect().toJSON()")
        x, y = self._chance.random(), self._chance.random()
        return box["x"] + x * box["width"], box["y"] + y * box["height"]

    def _key(self) -> None:
        self.page.press(self._chance.choice(KEYS))

    def _move(self) -> None:
        self.page.mouse("mouseMoved", *self._place(), self._chance.choice([0, 1]))

    def _press(self) -> None:
        kind = self._chance.choice(["mousePressed", "mouseReleased"])
        self.page.mouse(kind, *self._place(), 1)

    def _wheel(self) -> None:
        turn = self._chance.choice([-100, 100])
        self.page.mouse("mouseWheel", *self._place(), deltaX=0, deltaY=turn)

    def _touch(self) -> None:
        x, y = self._place()
        for kind, points in (("touchStart", [{"x": x, "y": y}]), ("touchEnd", [])):
            self.page.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def _control(self) -> None:
        if seen := self.page.ask(_SEEN):
            text = json.dumps(self._chance.choice(TEXTS))
            one = self._chance.choice(seen)
            self.page.ask(f"{_USE}({one}, {self._chance.random()}, {text}), 0")

    def _resize(self) -> None:
        self.page.resize(*self._chance.choice(SIZES), dark=self._chance.random() < 0.5)
