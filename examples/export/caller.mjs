// The exported library as WebAssembly, called from JavaScript: by node, and by pages.
//
//     asperity export sinusoid:amplitude=0.1mm,period=2mm --law C --shared -o texture.h
//     clang --target=wasm32 -std=c99 -O2 -ffreestanding -nostdlib -mbulk-memory \
//         -fvisibility=hidden -DTEXTURE_BUILD -DTEXTURE_NO_LIBC -Wl,--no-entry \
//         -Wl,--export-dynamic -Wl,--export=__heap_base -Wl,--allow-undefined texture.c -o texture.wasm
//     node caller.mjs texture.wasm
//
// With the names of two more files, it reads positions from one and writes the forces to the
// other: doubles, three for each tick.
const ABI = 1;
const FUNCTIONS = { fmod: (a, b) => a % b }; // others have the names of Math
const PAGE = 65536; // [bytes]

/** A contact with the force of a library, asked before; the bytes are those of the .wasm file. */
export class Texture {
  static async load(bytes, name = "texture") {
    const module = await WebAssembly.compile(bytes);
    const env = {};
    for (const wanted of WebAssembly.Module.imports(module)) {
      env[wanted.name] = FUNCTIONS[wanted.name] ?? Math[wanted.name];
    }
    return new Texture((await WebAssembly.instantiate(module, { env })).exports, name);
  }

  constructor(library, name) {
    const abi = library[`${name}_abi_version`]?.() ?? 0;
    if (abi !== ABI) {
      throw new Error(`the library has ABI ${abi}, this program ABI ${ABI}`);
    }
    const size = library[`${name}_state_size`]();
    this.library = library;
    this.name = name;
    this.at = Math.ceil(library.__heap_base.value / 16) * 16; // position, force, facts, state
    const end = this.at + 48 + 256 + size;
    library.memory.grow(Math.max(0, Math.ceil((end - library.memory.buffer.byteLength) / PAGE)));
    this.numbers = new Float64Array(library.memory.buffer, this.at, 6);
    this.facts = this.ask();
    if (this.facts.realSize !== 8) {
      throw new Error("the library takes float, this program double");
    }
    this.reset();
  }

  ask() {
    const view = new DataView(this.library.memory.buffer, this.at + 48, 256);
    view.setUint32(0, 200, true);
    this.library[`${this.name}_info`](this.at + 48);
    const names = ["stiffness", "maxDepth", "q", "qPlus", "maxForce", "maxPress", "friction"];
    const facts = { realSize: view.getUint32(8, true), stateSize: view.getUint32(12, true) };
    names.forEach((name, index) => (facts[name] = view.getFloat64(16 + 8 * index, true)));
    return facts;
  }

  reset() {
    this.library[`${this.name}_reset`](this.at + 304);
  }

  /** Force [N] at a position [m], three numbers each. */
  force(position) {
    this.numbers.set(position);
    this.library[`${this.name}_force`](this.at + 304, this.at, this.at + 24);
    return this.numbers.slice(3);
  }
}

async function main(path, from, to) {
  const { readFileSync, writeFileSync } = await import("node:fs");
  const texture = await Texture.load(readFileSync(path));
  if (to === undefined) {
    for (let tick = 0; tick < 5; tick++) {
      console.log(...texture.force([0.25e-3 * tick, 0.1e-3, -0.05e-3]));
    }
    return;
  }
  const rows = new Float64Array(new Uint8Array(readFileSync(from)).buffer);
  for (let at = 0; at < rows.length; at += 3) {
    rows.set(texture.force(rows.subarray(at, at + 3)), at);
  }
  writeFileSync(to, new Uint8Array(rows.buffer));
}

if (globalThis.process?.argv[1]?.endsWith("caller.mjs")) {
  main(...process.argv.slice(2)).catch((error) => {
    console.error(error.message);
    process.exitCode = 1;
  });
}
