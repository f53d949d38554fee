// How long it takes from the pointer to the picture that follows it.

const MOST = 5000; // that are kept

export class Latency {
  constructor() {
    this.waits = []; // changes: number, and since when [ms]
    this.all = []; // [ms]
    this.shown = 0; // the newest request that the last picture follows
    // A task after the picture says that the browser has done with it, or the next picture does: while a pointer
    // moves tasks may wait for longer.
    this.after = new MessageChannel();
    this.after.port2.onmessage = () => this.painted();
  }

  request(number, since) {
    this.waits.push([number, since]);
    if (this.waits.length > MOST) this.waits.shift();
  }

  /** Hear that a picture is being painted which follows a request. */
  paints(request) {
    this.shown = request;
    if (this.waits[0]?.[0] <= request) this.after.port1.postMessage(0);
  }

  /** Hear that the browser has done with the last picture. */
  painted() {
    while (this.waits[0]?.[0] <= this.shown) this.all.push(performance.now() - this.waits.shift()[1]);
    if (this.all.length > MOST) this.all.splice(0, this.all.length - MOST);
  }
}
