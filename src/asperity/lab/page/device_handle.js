// Controls of a real device: its user moves the handle, the page starts the loop and releases the force.

const $ = id => document.getElementById(id);

export class DeviceHandle {
  /** @param send sends a message of some type to the server */
  constructor(send) {
    this.isPresent = false;
    $("start").onclick = () => send("start");
    $("release").onclick = () => send("stop");
    // In the capture phase, so that Escape works while a field has the focus.
    addEventListener("keydown", event => { if (this.isPresent && event.key === "Escape") send("stop"); }, true);
  }

  /** Update the controls to a status of the session. */
  update({ handle, state, has_control: hasControl }) {
    this.isPresent = Boolean(handle);
    document.body.classList.toggle("real-device", this.isPresent);
    $("handle-note").hidden = !this.isPresent;
    if (handle) $("handle-note").textContent = `${handle.motion_source}. The guided tour and a second law beside need the simulated device: one handle has one law; asperity run --record records.`;
    $("start").textContent = handle ? "Start" : "Start again";
    $("start").hidden = state !== "stopped" || !hasControl;
    $("release").hidden = !handle || state === "stopped";
    $("release").disabled = !hasControl;
    $("tour-start").hidden = this.isPresent;
  }
}
