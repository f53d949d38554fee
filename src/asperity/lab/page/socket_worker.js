// Worker that owns the WebSocket: while the pointer moves, a browser delays the message events of the page.
//
// Received messages are passed in order through a ring buffer in shared memory, which the page reads
// when it paints. An entry is its length, whether it is text, and that many numbers, which are the
// UTF-16 code units of a text. A length of 0 marks that the next entry is at the start of the buffer.
// positions[0] is the write position, positions[1] the read position.

const backlog = []; // messages that did not fit into the buffer
let socket, positions, ring, writePosition = 0, usesBuffer = false;

/** Return whether an entry fits between the write position, or the start, and the read position. */
function hasSpace(size) {
  const readPosition = Atomics.load(positions, 1);
  if (writePosition < readPosition) return size < readPosition - writePosition;
  return size <= ring.length - writePosition || size < readPosition;
}

function writeEntry([isText, numbers]) {
  const size = numbers.length + 3; // including the 0 that may follow
  if (!hasSpace(size)) return false;
  if (size > ring.length - writePosition) { ring[writePosition] = 0; writePosition = 0; }
  ring.set([numbers.length, isText], writePosition);
  ring.set(numbers, writePosition + 2);
  writePosition += numbers.length + 2;
  Atomics.store(positions, 0, writePosition);
  return true;
}

function passOn(data) {
  if (!usesBuffer) { postMessage({ data }); return; }
  const isText = typeof data === "string";
  backlog.push([isText, isText ? Uint16Array.from(data, character => character.charCodeAt(0)) : new Float64Array(data)]);
  while (backlog.length && writeEntry(backlog[0])) backlog.shift();
}

const COMMANDS = {
  open(url) {
    socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => postMessage({ opened: true });
    socket.onclose = event => postMessage({ closed: event.reason });
    socket.onmessage = ({ data }) => passOn(data);
  },
  send(text) { if (socket.readyState === WebSocket.OPEN) socket.send(text); }, // the page learns of its closing later
  setBuffer(shared) { positions = new Int32Array(shared.positions); ring = new Float64Array(shared.ring); },
  useBuffer(isRead) { usesBuffer = isRead && Boolean(ring); postMessage({ usesBuffer }); },
};
onmessage = ({ data: [command, argument] }) => COMMANDS[command](argument);
