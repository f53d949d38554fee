// The connection to the server: frames and messages in, requests out; it reconnects by itself.

const STATE = 1;
const AGAIN = 1000; // ms until the next attempt
const MEMORY = 1 << 18; // numbers: more than all frames that are under way, and words

const letters = new TextDecoder("utf-16le");

/** Return what a frame holds, by the layout that the server has named. */
function readFrame(numbers, layout) {
  const { head, newest, least, greatest, forces } = layout;
  const at = name => numbers[head[name]], width = least - newest;
  const place = who => ["x", "y", "z"].map(axis => numbers[head[`${who} ${axis}`]]);
  return {
    number: at("frame"), rows: at("rows"), first: at("first"), acknowledged: at("acknowledged"), late: at("late"), skipped: at("skipped"),
    way: at("way"), squares: at("squares"), jump: at("jump"), moved: at("moved"),
    god: place("god"), hand: place("hand"), newest: numbers.subarray(newest, newest + width),
    least: numbers.subarray(least, least + width), greatest: numbers.subarray(greatest, greatest + width),
    forces: numbers.subarray(forces, forces + 3 * at("forces")),
  };
}

export class Line {
  /** @param hear object with hello, news, refused, frame, picture, lost */
  constructor(hear) {
    this.hear = hear;
    this.layout = null;
    this.there = false;
    this.reads = false; // from memory; else what comes is a message
    this.post = new Worker("socket_worker.js");
    this.post.onmessage = ({ data }) => this.told(data);
    // Where memory cannot be shared, and while nothing is painted, all comes as messages.
    if (globalThis.crossOriginIsolated) {
      const places = new SharedArrayBuffer(8), ring = new SharedArrayBuffer(8 * MEMORY);
      [this.places, this.ring] = [new Int32Array(places), new Float64Array(ring)];
      this.tell("memory", { places, ring });
    }
    const visible = () => this.tell("reads", !document.hidden);
    document.addEventListener("visibilitychange", visible);
    visible();
    this.open();
  }

  open() {
    const address = new URL("live", location.href);
    address.protocol = "ws:";
    address.hash = "";
    this.tell("open", String(address));
  }

  tell(what, content) { this.post.postMessage([what, content]); }

  told({ data, opened, closed, reads }) {
    this.look(); // what was written before comes before
    if (reads !== undefined) this.reads = reads;
    if (opened) this.there = true;
    if (data !== undefined) this.take(data);
    if (closed === undefined) return;
    this.there = false;
    this.hear.lost(closed);
    setTimeout(() => this.open(), AGAIN);
  }

  /** Take what has come into the memory. */
  look() {
    if (!this.reads) return;
    const { places, ring } = this, end = Atomics.load(places, 0);
    for (let at = Atomics.load(places, 1); at !== end; Atomics.store(places, 1, at)) {
      const length = ring[at];
      if (!length) { at = 0; continue; }
      const numbers = ring.slice(at + 2, at + 2 + length), text = ring[at + 1];
      at += length + 2;
      Atomics.store(places, 1, at); // before what may fail
      this.take(text ? letters.decode(Uint16Array.from(numbers)) : numbers.buffer);
    }
  }

  take(data) {
    if (typeof data === "string") {
      const said = JSON.parse(data);
      if (said.say === "hello") this.layout = said.layout;
      this.hear[said.say]?.(said);
      return;
    }
    const numbers = new Float64Array(data);
    if (numbers[0] === STATE) this.hear.frame(readFrame(numbers, this.layout));
    else this.hear.picture(numbers);
  }

  /** Say something, if somebody listens; whether it was said. */
  say(what, content = {}) {
    if (!this.there) return false;
    this.tell("say", JSON.stringify({ do: what, ...content }));
    return true;
  }
}
