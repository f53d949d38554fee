"""What is heard: the worklet of the page, rendered by a real browser faster than time."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tests.lab.browser import Browser, needs_browser

from asperity.core.checks import FloatArray

SPEAKER = 48_000.0
EVERY = 0.02
"""[s] of the loop in a message: rendering waits for each, as it comes in time."""
LONG = 0.6
RENDER = """(async ({ rate, forces, every, long }) => {
  const context = new OfflineAudioContext(2, long * 48000, 48000);
  await context.audioWorklet.addModule("force_audio_processor.js");
  const options = { numberOfInputs: 0, outputChannelCount: [2] };
  const processor = new AudioWorkletNode(context, "force-audio", options);
  processor.connect(context.destination);
  const part = Math.round(every * rate), pause = () => new Promise(done => setTimeout(done, 3));
  for (let k = 0; k * every < long; k++) {
    context.suspend(k * every).then(async () => {
      const rows = new Float32Array(forces.slice(2 * k * part, 2 * (k + 1) * part));
      if (rows.length) processor.port.postMessage({ updateRate: rate, forces: rows });
      await pause();
      context.resume();
    });
  }
  const heard = await context.startRendering();
  return [0, 1].map(side => Array.from(heard.getChannelData(side)));
})"""


def heard(page: Browser, rate: float, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return what is heard (2, samples) of forces at the loop's rate."""
    forces = np.round(np.column_stack([left, right]), 6).ravel().tolist()
    said = {"rate": rate, "forces": forces, "every": EVERY, "long": LONG}
    return np.array(page.ask(f"{RENDER}({json.dumps(said)})"))


def strongest(sound: FloatArray) -> float:
    """Return the strongest frequency of the second half [Hz]."""
    part = sound[len(sound) // 2 :]
    spectrum = np.abs(np.fft.rfft(part * np.hanning(len(part)), 8 * len(part)))
    return float(np.argmax(spectrum) * SPEAKER / (8 * len(part)))


@needs_browser
@pytest.mark.parametrize(("rate", "tones"), [(10e3, (800.0, 1900.0)), (1e3, (60.0, 210.0))])
def test_a_tone_of_the_force_is_heard_at_its_pitch(
    page: Browser, rate: float, tones: tuple[float, float]
) -> None:
    time = np.arange(round(LONG * rate)) / rate
    sides = heard(page, rate, *(0.2 * np.sin(2.0 * np.pi * tone * time) for tone in tones))
    for sound, tone in zip(sides, tones, strict=True):
        # What keeps the lag moves the pitch by 2 % at most.
        assert strongest(sound) == pytest.approx(tone, rel=0.02)
        assert np.abs(sound[len(sound) // 2 :]).max() > 0.2


@needs_browser
def test_it_is_never_louder_than_full_and_a_force_that_rests_is_not_heard(page: Browser) -> None:
    rate = 1e3
    steps = np.where(np.arange(round(LONG * rate)) % 50 < 25, 1e4, -1e4)
    loud, still = heard(page, rate, steps, np.full(len(steps), 3.0))
    assert 0.9 < np.abs(loud).max() <= 1.0
    # After the step at the beginning, which dies out.
    assert np.abs(still[len(still) // 2 :]).max() < 1e-4


@needs_browser
def test_nothing_sounds_until_it_is_asked_for(page: Browser) -> None:
    page.ask(
        "globalThis.made = []; globalThis.AudioContext = class extends AudioContext {"
        " constructor() { super(); made.push(this); } }; 0"
    )
    page.until("lab.frame.number > 0")
    assert page.ask("made.length") == 0
    assert page.ask("document.getElementById('sound').getAttribute('aria-pressed')") == "false"
    page.press("s")
    page.until("made[0]?.state == 'running'")
    page.press("s")
    page.until("made[0].state == 'suspended'")
    assert page.ask("made.length") == 1
