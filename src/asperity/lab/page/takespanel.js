// The card of recordings: what was kept, a slider, and the file of each.

const $ = id => document.getElementById(id);

export class TakesPanel {
  /** @param host object with player, columns, change(wishes), save() and settings */
  constructor(host) {
    this.host = host;
    $("save").onclick = () => host.save();
    $("live").onclick = () => this.close();
    $("play").onclick = () => { host.player.toggle(); this.draw(); };
    $("at").oninput = event => {
      host.player.playing = false;
      host.player.seek(event.target.value / 1000 * host.player.length);
      this.draw();
    };
  }

  /** List a take that was kept. */
  add({ number, archive, table, settings, duration }) {
    const item = document.createElement("li"), show = document.createElement("button"), file = document.createElement("a");
    Object.assign(show, { type: "button", textContent: `Show ${number}`, onclick: () => this.open(table, settings) });
    Object.assign(file, { href: archive, download: `asperity-${archive}`, textContent: "save recording and scene" });
    item.append(show, `law ${settings.law}, ${duration.toFixed(1)} s`, file);
    $("takes").prepend(item);
    while ($("takes").children.length > 4) $("takes").lastElementChild.remove();
  }

  async open(table, settings) {
    const answer = await fetch(table);
    if (!answer.ok) return;
    const numbers = new Float64Array(await answer.arrayBuffer()), now = this.host.settings;
    // What is drawn behind it is the surface that it was felt on.
    const others = Object.entries(settings).filter(([name, value]) => value !== null && value !== now[name]);
    if (others.length) this.host.change(Object.fromEntries(others));
    this.host.player.open(numbers, this.host.columns);
    this.draw();
  }

  close() {
    this.host.player.close();
    this.host.player.show.clear();
    this.draw();
  }

  draw() {
    const { player } = this.host;
    $("live").hidden = $("replay").hidden = !player.on;
    if (!player.on) return;
    $("play").textContent = player.playing ? "Pause" : "Play";
    if (player.playing) $("at").value = 1000 * player.time / player.length;
    $("at-value").textContent = `${player.time.toFixed(2)} of ${player.length.toFixed(1)} s`;
  }
}
