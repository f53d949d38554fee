// Measurement of the latency from a motion of the pointer to the first picture that shows the response.

const MAX_ENTRIES = 5000; // of pending requests, and of latencies

export class LatencyMonitor {
  constructor() {
    this.pending = []; // requests: number, and time of the motion [ms]
    this.latencies = []; // [ms]
    this.drawnRequest = 0; // newest request whose response is in the last picture
    // A picture is presented by the time a task queued after drawing runs, or the next picture is drawn,
    // whichever comes first: tasks may be delayed while the pointer moves.
    this.channel = new MessageChannel();
    this.channel.port2.onmessage = () => this.recordPresented();
  }

  addRequest(number, time) {
    this.pending.push([number, time]);
    if (this.pending.length > MAX_ENTRIES) this.pending.shift();
  }

  /** Note that a picture is being drawn that shows the response to a request. */
  recordDrawn(request) {
    this.drawnRequest = request;
    if (this.pending[0]?.[0] <= request) this.channel.port1.postMessage(0);
  }

  /** Note that the last picture has been presented. */
  recordPresented() {
    while (this.pending[0]?.[0] <= this.drawnRequest) this.latencies.push(performance.now() - this.pending.shift()[1]);
    if (this.latencies.length > MAX_ENTRIES) this.latencies.splice(0, this.latencies.length - MAX_ENTRIES);
  }
}
