// Damages a culling file again and again: scarp.mjs has to refuse each, with an error of its own.
//   node corruptions.mjs FILE RUNS [SEED]
import { readFile } from 'node:fs/promises';
import { Culling, MovingView, ScarpFileError } from '../../tiles/runtime/scarp.mjs';

const [file, runs, seed = '1'] = process.argv.slice(2);
const sound = new Uint8Array(await readFile(file));
let state = Number(seed) >>> 0 || 1;
function below(limit) {
  state ^= state << 13;
  state ^= state >>> 17;
  state ^= state << 5;
  return (state >>> 0) % limit;
}

function damage(bytes) {
  const at = below(bytes.length);
  switch (below(5)) {
    case 0: return bytes.slice(0, at);
    case 1: bytes[at] ^= 1 << below(8); return bytes;
    case 2: bytes[at] = below(256); return bytes;
    case 3: {
      const values = [0, 1, 0x7fffffff, 0x80000000, 0xffffffff];
      const word = at & ~3;
      if (word + 4 <= bytes.length)
        new DataView(bytes.buffer).setUint32(word, values[below(values.length)], true);
      return bytes;
    }
    default: {
      const size = Math.min(1 + below(80), bytes.length - at);
      bytes.copyWithin(below(bytes.length - size + 1), at, at + size);
      return bytes;
    }
  }
}

// Everything that there is to ask: with checksums left aside, damage may give wrong answers only.
function ask(culling) {
  const groups = new Uint32Array(culling.groups);
  const moving = new MovingView(culling);
  for (const [x, y, z] of [[30, 70, 2], [-4000, 55, 300], [1e5, -2e5, 1e4]]) {
    const camera = culling.cameraInFrame(x, y, z);
    const frustum = culling.frustum(camera, [0.6, -0.8, 0.1, 3]);
    culling.visible(camera, frustum, groups);
    moving.visible(camera, frustum, groups);
    for (let t = 0; t < Math.min(culling.tiles, 8); ++t) culling.tileAnswer(camera, t);
    culling.boxVisible(camera, culling.boxInFrame(y, x, y + 5, x + 9, 4));
  }
}

let refused = 0;
let same = 0;
for (let run = 0; run < Number(runs); ++run) {
  let bytes = sound.slice();
  for (let i = 1 + below(4); i > 0 && bytes.length > 0; --i) bytes = damage(bytes);
  for (const check of ['everything', 'structure']) {
    try {
      const culling = new Culling(bytes, { check });
      ask(culling);
      if (check === 'structure') continue;
      if (Buffer.compare(bytes, sound) !== 0) throw new Error(`run ${run}: damage was not noticed`);
      ++same;
    } catch (error) {
      if (!(error instanceof ScarpFileError)) throw error;
      if (check === 'everything') ++refused;
    }
  }
}
console.log(`${refused} refused, ${same} unchanged`);
