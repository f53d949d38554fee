// List of clips, and the controls of the player: play, pause, seek, and return to the live loop.

import { ScaledCanvas, colours } from "./canvas.js";

const MAX_CLIPS = 4; // of this session, as in the clip store of the server
const $ = id => document.getElementById(id);

export class ClipsPanel {
  /** @param host object with player, columns, changeScene(changes), saveClip() and surfaceVersion */
  constructor(host) {
    this.host = host;
    this.pendingClip = null; // opened as soon as pictures of its surface are available
    this.overview = new ScaledCanvas($("overview"));
    $("save-clip").onclick = () => host.saveClip();
    $("return-to-live").onclick = () => this.close();
    $("play").onclick = () => { host.player.togglePlaying(); this.update(); };
    $("playback-time").oninput = event => {
      host.player.isPlaying = false;
      host.player.seek(event.target.value / event.target.max);
      this.update();
    };
  }

  /** Add a clip of this session, or a recording that was opened at the start, to the list. */
  add(clip) {
    if ([...$("clips").children].some(item => item.dataset.name === clip.name)) return;
    const { name, archive, title, law, playback } = clip, item = document.createElement("li");
    const button = document.createElement("button"), description = document.createElement("span");
    Object.assign(button, { type: "button", textContent: `Show ${title}`, onclick: () => this.open(clip) });
    description.textContent = `law ${law}, ${formatTime(playback.row_count * playback.period)}`;
    item.dataset.name = name;
    item.append(button, description);
    if (archive) item.append(Object.assign(document.createElement("a"), { href: archive, download: `asperity-${archive}`, textContent: "save recording and scene" }));
    $("clips").prepend(item);
    const savedClips = [...$("clips").children].filter(({ dataset }) => dataset.name.startsWith("clip-"));
    for (const oldItem of savedClips.slice(MAX_CLIPS)) oldItem.remove();
    if (clip.opens_at_start) this.pendingClip = clip;
  }

  open(clip) {
    // The views show the surface of the recording.
    this.host.changeScene({ saved_scene: clip.name });
    this.host.player.open(clip, this.host.columns);
    $("playback-time").max = clip.playback.row_count;
    this.update();
  }

  close() {
    const { player } = this.host;
    if (!player.isOpen) return;
    player.close();
    player.display.clear();
    this.update();
  }

  update() {
    const { player } = this.host;
    if (this.pendingClip && this.host.surfaceVersion) {
      const clip = this.pendingClip;
      this.pendingClip = null;
      this.open(clip);
      return;
    }
    $("playback").hidden = !player.isOpen;
    if (!player.isOpen) return;
    $("play").textContent = player.isPlaying ? "Pause" : "Play";
    if (player.isPlaying) $("playback-time").value = player.fraction * $("playback-time").max;
    $("playback-time-value").textContent = `${formatTime(player.time, 2)} of ${formatTime(player.duration)}`;
    $("playback-time").setAttribute("aria-valuetext", $("playback-time-value").textContent);
    this.drawOverview(player);
  }

  /** Draw the range of the force in each bin of the recording, and the current time. */
  drawOverview({ playback, fraction }) {
    const [context, width, height] = this.overview.clear(), ranges = playback.forceRanges, binWidth = width / ranges.length;
    const maximum = ranges.reduce((largest, [, high]) => Math.max(largest, high), 1e-9);
    const y = force => (1 - force / maximum) * (height - 2) + 1;
    context.fillStyle = colours().red;
    ranges.forEach(([low, high], k) => context.fillRect(k * binWidth, y(high), Math.max(binWidth, 0.5), Math.max(y(low) - y(high), 1)));
    context.fillStyle = colours().ink;
    context.fillRect(fraction * width - 1, 0, 2, height);
  }
}

/** Return a time as text: "12.3 s", "1:02:03". */
function formatTime(time, digits = 1) {
  if (time < 60) return `${time.toFixed(digits)} s`;
  const parts = [time / 3600, time / 60 % 60, time % 60].map(Math.floor);
  return parts.slice(parts[0] ? 0 : 1).map((part, k) => (k ? String(part).padStart(2, "0") : part)).join(":");
}
