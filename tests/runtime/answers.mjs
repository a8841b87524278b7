// Answers of scarp.mjs to cameras of a file, a line each: those of answers.cc.
import { readFile } from 'node:fs/promises';
import { MovingView, open } from '../../tiles/runtime/scarp.mjs';

function hashOf(values, count) {
  let hash = 2166136261;
  for (let i = 0; i < count; ++i)
    for (let shift = 0; shift < 32; shift += 8)
      hash = Math.imul(hash ^ ((values[i] >>> shift) & 255), 16777619);
  return (hash >>> 0).toString(16).padStart(8, '0');
}

const [file, questions] = process.argv.slice(2);
const culling = await open(file);
const bytes = await readFile(questions);
const q = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const groups = new Uint32Array(culling.groups);
const moving = new MovingView(culling);
const lines = [];
for (let i = 0; i + 10 < q.length; i += 11) {
  const [kind, x, y, z] = q.subarray(i, i + 4);
  const camera = kind === 0 ? culling.camera(x, y, z) : culling.cameraInFrame(x, y, z);
  const frustum = culling.frustum(camera, q.subarray(i + 4, i + 8));
  const all = culling.visible(camera, null, groups);
  const allHash = hashOf(groups, all);
  const moved = moving.visible(camera, null, groups);
  const isSame = moved === all && hashOf(groups, moved) === allHash;
  const some = culling.visible(camera, frustum, groups);
  const someHash = hashOf(groups, some);
  const tiles = [];
  for (let t = 0; t < culling.tiles; ++t) tiles.push(culling.tileAnswer(camera, t));
  const [atX, atY, half] = q.subarray(i + 8, i + 11);
  const box = culling.boxInFrame(atX - half, atY - half, atX + half, atY + half, z);
  const hull = culling.box([x, y, z, x + half, y + half, z + half]);
  lines.push(`${all} ${allHash} ${some} ${someHash} ${hashOf(tiles, tiles.length)} ` +
    `${+culling.boxVisible(camera, box)} ${+culling.boxVisible(camera, hull)} ${+culling.boxVisibleFromCell(hull, box)} ${hull.lowX} ` +
    `${hull.highY} ${hull.top} ${isSame ? 'same' : 'DIFFERS'}`);
}
process.stdout.write(lines.map((line) => line + '\n').join(''));
