// Requests of the pictures of the views, and whether each picture is of the surface that is rendered now.

import { formatQuantity } from "./format.js";

const RETRY_DELAY = 500; // ms, after a picture was not available
// Requests pause for a multiple of the time that a picture took, so that pictures use a tenth of a core.
const REST_FACTOR = 8;
const RELIEF_SETTINGS = ["texture", "magnify", "magnify_height"]; // all that the relief depends on

export class Pictures {
  /** @param send sends a message to the server; @param views by kind: relief and section */
  constructor(send, views) {
    this.send = send;
    this.views = views;
    this.status = null; // the newest one of the server
    this.readySettings = {}; // of the newest surface whose pictures are available
    this.forgetRequests();
  }

  /** Forget all requests, and take the pictures for stale: another server may follow. */
  forgetRequests() {
    this.requests = {}; // the newest one by kind: key, version, settings, time sent and earliest next request [ms]
    for (const view of Object.values(this.views)) view.version = -1;
  }

  /** Note the newest status; null without a connection. */
  setStatus(status) {
    if (status?.surface_version !== this.status?.surface_version) this.endPauses();
    this.status = status;
    if (!status) this.forgetRequests();
    else if (status.pictures_current) this.readySettings = status.settings;
    this.showStaleness();
  }

  /** Request a picture unless it is the newest one requested, that one is pending, or the pause has not passed. */
  request(kind, content) {
    const { surface_version: version, start_count: startCount } = this.status, now = performance.now();
    const key = `${version} ${startCount} ${JSON.stringify(content)}`, previous = this.requests[kind];
    if (!version || previous?.key === key || now < (previous?.nextTime ?? 0)) return;
    if (this.send(kind, content)) this.requests[kind] = { key, version, settings: this.readySettings, sentTime: now, nextTime: Infinity };
  }

  receive(view, numbers) {
    const request = this.requests[view.kind], now = performance.now();
    if (!request) return; // from before a loss of the connection
    request.nextTime = now + REST_FACTOR * (now - request.sentTime);
    // The picture is of the surface at the request, or of a later one, which is then requested again.
    Object.assign(view, { version: request.version, settings: request.settings });
    view.setPicture(numbers);
    this.showStaleness();
  }

  noteUnavailable(kind) {
    if (this.requests[kind]) Object.assign(this.requests[kind], { key: "", version: -1, nextTime: performance.now() + RETRY_DELAY });
  }

  /** End the pauses: the next requests are sent at once. */
  endPauses() {
    for (const request of Object.values(this.requests)) if (request.nextTime < Infinity) request.nextTime = 0;
  }

  /** Whether a picture is of the surface and the law of the status. */
  isCurrent(view) {
    const { status } = this;
    if (!status || !(view.version >= 0)) return false;
    if (status.pictures_current && view.version === status.surface_version) return true;
    return view.kind === "relief" && RELIEF_SETTINGS.every(name => view.settings[name] === status.settings[name]);
  }

  /** Return what a picture is of while it is not current; empty if it is. */
  staleText(view) {
    if (this.isCurrent(view)) return "";
    const next = this.status?.picture_message ? "no newer picture" : "computing …";
    if (!(view.version >= 0)) return next;
    const { law, stiffness } = view.settings;
    return `${view.kind === "relief" ? "of the previous surface" : `of law ${law} at ${formatQuantity(stiffness, "N/m")}`}: ${next}`;
  }

  /** Grey the pictures that are not current. */
  showStaleness() {
    for (const view of Object.values(this.views)) view.scaledCanvas.element.classList.toggle("stale", !this.isCurrent(view));
  }

  /** Whether the newest requests were answered, by pictures of the current surface. */
  get areCurrent() {
    return Object.values(this.views).every(view => this.requests[view.kind]?.nextTime < Infinity && view.version === this.status?.surface_version)
      && Boolean(this.status?.pictures_current);
  }
}
