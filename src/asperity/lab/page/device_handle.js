// The handle that somebody holds: the page does not move it, but starts its loop and lets its force go.

const $ = id => document.getElementById(id);

export class Handle {
  /** @param say says something to the lab */
  constructor(say) {
    this.there = false;
    $("again").onclick = () => say("start");
    $("halt").onclick = () => say("stop");
    // Whatever is being typed into.
    addEventListener("keydown", event => { if (this.there && event.key === "Escape") say("stop"); }, true);
  }

  /** Show how things stand. */
  show({ handle, state, steers }) {
    this.there = Boolean(handle);
    document.body.classList.toggle("held", this.there);
    $("held").hidden = !this.there;
    if (handle) $("held").textContent = `${handle.where}. The guided tour needs the simulated device; asperity run --record records.`;
    $("again").textContent = handle ? "Start" : "Start again";
    $("again").hidden = state !== "stopped" || !steers;
    $("halt").hidden = !handle || state === "stopped";
    $("halt").disabled = !steers;
    $("tour-begin").hidden = this.there;
  }
}
