// The connection to the lab: frames and words in, wishes out; it comes back by itself.

const STATE = 1;
const AGAIN = 1000; // ms until the next attempt

/** Return what a frame holds, by the layout that the server has named. */
function readFrame(numbers, layout) {
  const { head, newest, least, greatest, forces } = layout;
  const at = name => numbers[head[name]], width = least - newest;
  const place = who => ["x", "y", "z"].map(axis => numbers[head[`${who} ${axis}`]]);
  return {
    number: at("frame"), rows: at("rows"), first: at("first"), heard: at("heard"), late: at("late"), skipped: at("skipped"),
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
    this.wishes = 0;
    this.open();
  }

  open() {
    const address = new URL("live", location.href);
    address.protocol = "ws:";
    address.hash = "";
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = event => this.take(event.data);
    this.socket.onclose = event => {
      this.hear.lost(event.reason);
      setTimeout(() => this.open(), AGAIN);
    };
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
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify({ do: what, ...content }));
    return true;
  }
}
