// Connection to the server, which is restored after a loss: decodes frames and messages, and sends requests.

const FRAME = 1; // first number of a binary message that is a frame, not a picture
const RECONNECT_DELAY = 1000; // ms
const RING_LENGTH = 1 << 18; // numbers: more than all pending frames and messages

const utf16 = new TextDecoder("utf-16le");

/** Return the content of a frame, by the layout that the server sent. */
function decodeFrame(numbers, layout) {
  const { header, newest, minima, maxima, forces } = layout, width = minima - newest;
  const value = name => numbers[header[name]];
  const point = name => ["x", "y", "z"].map(axis => value(`${name} ${axis}`));
  return {
    number: value("frame"), lane: value("lane"), rowCount: value("rows"), firstRow: value("first"),
    acknowledged: value("acknowledged"), late: value("late"), skipped: value("skipped"),
    lateness: value("lateness"), truncated: value("truncated"),
    forceLimited: value("force_limited"), tooDeep: value("too_deep"), deepest: value("deepest"),
    pathLength: value("path_length"), squaredSteps: value("squared_steps"),
    maxForceStep: value("max_force_step"), anchorSlip: value("anchor_slip"), positionStep: value("position_step"),
    closest: point("closest"), hand: point("hand"), newest: numbers.subarray(newest, newest + width),
    minima: numbers.subarray(minima, minima + width), maxima: numbers.subarray(maxima, maxima + width),
    forces: numbers.subarray(forces, forces + 3 * value("forces")),
  };
}

export class Connection {
  /** @param handlers functions by type of message, and frame, picture and disconnected */
  constructor(handlers) {
    this.handlers = handlers;
    this.layout = null;
    this.isOpen = false;
    this.usesBuffer = false; // else the worker posts each message
    this.worker = new Worker("socket_worker.js");
    this.worker.onmessage = ({ data }) => this.handleWorkerMessage(data);
    // The buffer is used only where memory can be shared, and while the page is painted.
    if (globalThis.crossOriginIsolated) {
      const positions = new SharedArrayBuffer(8), ring = new SharedArrayBuffer(8 * RING_LENGTH);
      [this.positions, this.ring] = [new Int32Array(positions), new Float64Array(ring)];
      this.post("setBuffer", { positions, ring });
    }
    const updateVisibility = () => this.post("useBuffer", !document.hidden);
    document.addEventListener("visibilitychange", updateVisibility);
    updateVisibility();
    this.open();
  }

  open() {
    const url = new URL("live", location.href);
    url.protocol = "ws:";
    url.hash = "";
    this.post("open", String(url));
  }

  /** Send a command to the worker. */
  post(command, argument) { this.worker.postMessage([command, argument]); }

  handleWorkerMessage({ data, opened, closed, usesBuffer }) {
    this.readBuffer(); // its messages were received earlier
    if (usesBuffer !== undefined) this.usesBuffer = usesBuffer;
    if (opened) this.isOpen = true;
    if (data !== undefined) this.receive(data);
    if (closed === undefined) return;
    this.isOpen = false;
    this.handlers.disconnected(closed);
    setTimeout(() => this.open(), RECONNECT_DELAY);
  }

  /** Receive all messages in the buffer. */
  readBuffer() {
    if (!this.usesBuffer) return;
    const { positions, ring } = this, end = Atomics.load(positions, 0);
    for (let position = Atomics.load(positions, 1); position !== end; Atomics.store(positions, 1, position)) {
      const length = ring[position];
      if (!length) { position = 0; continue; }
      const numbers = ring.slice(position + 2, position + 2 + length), isText = ring[position + 1];
      position += length + 2;
      Atomics.store(positions, 1, position); // before a handler that may throw
      this.receive(isText ? utf16.decode(Uint16Array.from(numbers)) : numbers.buffer);
    }
  }

  receive(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      if (message.type === "hello") this.layout = message.layout;
      this.handlers[message.type]?.(message);
      return;
    }
    const numbers = new Float64Array(data);
    if (numbers[0] === FRAME) this.handlers.frame(decodeFrame(numbers, this.layout));
    else this.handlers.picture(numbers);
  }

  /** Send a message to the server; return whether the connection is open. */
  send(type, payload = {}) {
    if (!this.isOpen) return false;
    this.post("send", JSON.stringify({ type, ...payload }));
    return true;
  }
}
