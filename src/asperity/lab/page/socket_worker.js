// The connection, in a thread of its own: while a pointer moves, a browser lets the page's messages wait.
//
// What comes goes, in its order, into memory that the page reads when it paints: its length, whether it is text,
// then numbers, which are the letters of a text. A length of 0 says that the next one begins the memory anew.

const waiting = []; // what found no room
let socket, places, ring, at = 0, reads = false;

/** Return whether there is room from a place on, or from the beginning, before what was not read yet. */
function room(size) {
  const read = Atomics.load(places, 1);
  if (at < read) return size < read - at;
  return size <= ring.length - at || size < read;
}

function write([text, numbers]) {
  const size = numbers.length + 3; // with the 0 that may follow
  if (!room(size)) return false;
  if (size > ring.length - at) { ring[at] = 0; at = 0; }
  ring.set([numbers.length, text], at);
  ring.set(numbers, at + 2);
  at += numbers.length + 2;
  Atomics.store(places, 0, at);
  return true;
}

function take(data) {
  if (!reads) { postMessage({ data }); return; }
  const text = typeof data === "string";
  waiting.push([text, text ? Uint16Array.from(data, letter => letter.charCodeAt(0)) : new Float64Array(data)]);
  while (waiting.length && write(waiting[0])) waiting.shift();
}

const TOLD = {
  open(address) {
    socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => postMessage({ opened: true });
    socket.onclose = event => postMessage({ closed: event.reason });
    socket.onmessage = ({ data }) => take(data);
  },
  say(text) { socket.send(text); },
  memory(shared) { places = new Int32Array(shared.places); ring = new Float64Array(shared.ring); },
  reads(does) { reads = does && Boolean(ring); postMessage({ reads }); },
};
onmessage = ({ data: [what, content] }) => TOLD[what](content);
