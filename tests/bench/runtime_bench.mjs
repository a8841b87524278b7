// The JavaScript half of runtime_bench: node runtime_bench.mjs FILE EYES
// EYES: places of the frame, three doubles each; the first half at random, the second a flight.
import { readFile } from 'node:fs/promises';
import { MovingView, open } from '../../tiles/runtime/scarp.mjs';

const [file, eyesFile] = process.argv.slice(2);
const begun = performance.now();
const culling = await open(file);
const openUs = (performance.now() - begun) * 1000;
const bytes = await readFile(eyesFile);
const places = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const count = places.length / 6;
const groups = new Uint32Array(culling.groups);
const cameraAt = (i) => culling.cameraInFrame(places[3 * i], places[3 * i + 1], places[3 * i + 2]);

function timeUs(first, ask) {
  for (let i = 0; i < Math.min(count, 200); ++i) ask(cameraAt(first + i)); // until it is compiled
  const times = [];
  for (let i = 0; i < count; ++i) {
    const start = performance.now();
    ask(cameraAt(first + i));
    times.push((performance.now() - start) * 1000);
  }
  times.sort((a, b) => a - b);
  return times[times.length >> 1];
}

const randomUs = timeUs(0, (camera) => culling.visible(camera, null, groups));
const flightUs = timeUs(count, (camera) => culling.visible(camera, null, groups));
const moving = new MovingView(culling);
const movingUs = timeUs(count, (camera) => moving.visible(camera, null, groups));
console.log(JSON.stringify({
  open_us: openUs, random_us: randomUs, flight_us: flightUs, flight_moving_us: movingUs,
}));
