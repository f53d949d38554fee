// The page of a session: shows what the program sends, and sends the keys that are pressed.
// Nothing about a stimulus is known here.

import { MaskingNoise } from "./masking_noise.js";

const KEY_NAMES = { Enter: "Enter", Escape: "Esc", ArrowUp: "↑", ArrowDown: "↓", Backspace: "⌫", p: "P" };
const part = (name) => document.getElementById(name);
const noise = new MaskingNoise();
let view = null;

const socket = new WebSocket(new URL("live", location.href).href.replace("http", "ws"));

function send(key) {
  if (socket.readyState === WebSocket.OPEN) socket.send(key);
}

function keyButton([key, label]) {
  const item = document.createElement("li");
  const button = document.createElement("button");
  const name = document.createElement("kbd");
  button.type = "button";
  button.dataset.key = key;
  name.textContent = KEY_NAMES[key] ?? key;
  button.append(name, label);
  button.addEventListener("click", () => send(key));
  item.append(button);
  return item;
}

function show(message) {
  view = JSON.parse(message);
  part("title").textContent = view.title;
  part("text").textContent = view.text;
  part("text").hidden = !view.text;
  part("typed").textContent = view.typed;
  part("typed").hidden = !view.typed;
  part("keys").replaceChildren(...view.keys.map(keyButton));
  part("keys").hidden = !view.keys.length;
  part("state").textContent = view.noise
    ? "Noise masks the sound of the device; it begins with your first key."
    : "Keys: a pedal may send them, too.";
  globalThis.study = { view, noise };
}

socket.addEventListener("message", ({ data }) => show(data));
socket.addEventListener("close", () => {
  part("keys").hidden = true;
  part("typed").hidden = true;
  if (!view?.is_last) {
    part("title").textContent = "Stopped";
    part("text").textContent = "The force is released.";
    part("text").hidden = false;
  }
  part("state").textContent = "The session has ended, or the connection is lost. Ask the experimenter.";
});

document.addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
  const key = event.key === " " ? "Enter" : event.key.length === 1 ? event.key.toLowerCase() : event.key;
  // A focused button is pressed by its own key: Enter would count twice.
  if (key === "Enter" || key === "Backspace" || key.startsWith("Arrow")) event.preventDefault();
  if (view?.noise) noise.start();
  const focused = document.activeElement?.dataset?.key;
  send(key === "Enter" && focused ? focused : key);
});
