// The card of recordings: what was kept, where in it one is, and the file of each.

import { Sheet, colours } from "./canvas.js";

const $ = id => document.getElementById(id);

export class TakesPanel {
  /** @param host object with player, columns, change(changes), save() and version */
  constructor(host) {
    this.host = host;
    this.first = null; // a recording of elsewhere, to be shown when its surface can be
    this.overview = new Sheet($("overview"));
    $("save").onclick = () => host.save();
    $("live").onclick = () => this.close();
    $("play").onclick = () => { host.player.toggle(); this.draw(); };
    $("at").oninput = event => {
      host.player.playing = false;
      host.player.seek(event.target.value / event.target.max);
      this.draw();
    };
  }

  /** List a take that was kept, or a recording of elsewhere. */
  add(take) {
    if ([...$("takes").children].some(item => item.dataset.name === take.name)) return;
    const { name, archive, title, law, opens, playback } = take, item = document.createElement("li");
    const show = document.createElement("button"), words = document.createElement("span");
    Object.assign(show, { type: "button", textContent: `Show ${title}`, onclick: () => this.open(take) });
    words.textContent = `law ${law}, ${clock(playback.rows * playback.period)}`;
    item.dataset.name = name;
    item.append(show, words);
    if (archive) item.append(Object.assign(document.createElement("a"), { href: archive, download: `asperity-${archive}`, textContent: "save recording and scene" }));
    $("takes").prepend(item);
    const takes = [...$("takes").children].filter(one => one.dataset.name.startsWith("take-"));
    for (const old of takes.slice(4)) old.remove();
    if (opens) this.first = take;
  }

  open(take) {
    // What is drawn behind it is the surface that it was felt on.
    this.host.change({ stage: take.name });
    this.host.player.open(take, this.host.columns);
    $("at").max = take.playback.rows;
    this.draw();
  }

  close() {
    const { player } = this.host;
    if (!player.on) return;
    player.close();
    player.show.clear();
    this.draw();
  }

  draw() {
    const { player } = this.host;
    if (this.first && this.host.version) { const take = this.first; this.first = null; this.open(take); return; }
    $("replay").hidden = !player.on;
    if (!player.on) return;
    $("play").textContent = player.playing ? "Pause" : "Play";
    if (player.playing) $("at").value = player.share * $("at").max;
    $("at-value").textContent = `${clock(player.time, 2)} of ${clock(player.length)}`;
    $("at").setAttribute("aria-valuetext", $("at-value").textContent);
    this.drawForce(player);
  }

  /** Draw from the least to the greatest force of each part, and where one is. */
  drawForce({ playback, share }) {
    const [draw, width, height] = this.overview.cleared(), { force } = playback, wide = width / force.length;
    const most = force.reduce((sofar, [, greatest]) => Math.max(sofar, greatest), 1e-9), y = value => (1 - value / most) * (height - 2) + 1;
    draw.fillStyle = colours().red;
    force.forEach(([least, greatest], k) => draw.fillRect(k * wide, y(greatest), Math.max(wide, 0.5), Math.max(y(least) - y(greatest), 1)));
    draw.fillStyle = colours().ink;
    draw.fillRect(share * width - 1, 0, 2, height);
  }
}

/** Return a time in words: "12.3 s", "1:02:03". */
function clock(time, digits = 1) {
  if (time < 60) return `${time.toFixed(digits)} s`;
  const parts = [time / 3600, time / 60 % 60, time % 60].map(Math.floor);
  return parts.slice(parts[0] ? 0 : 1).map((part, k) => (k ? String(part).padStart(2, "0") : part)).join(":");
}
