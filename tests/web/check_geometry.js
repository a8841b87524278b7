// What a tileset says of its tiles, against their vertices, with no code of Scarp's: boxes hold their own vertices
// and those of all tiles below; heights bracket them; a camera from which the ellipsoid hides a tile's horizon occlusion
// point sees none of them past the lowest ground; levels are no better than finer ones.
import { join } from "node:path";
import { readGlb, readTiles, readTileset } from "./tileset_files.js";

const folder = process.argv[2];
const tileset = readTileset(folder);
const tiles = readTiles(folder, tileset);
const m = tileset.root.transform;
const a = 6378137;
const b = a * (1 - 1 / 298.257223563);
const e2 = 1 - (b * b) / (a * a);
let faults = 0;
const fault = (text) => {
  if (++faults < 20) console.error(text);
};

const toEcef = ([x, y, z]) => [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
const dot = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
const minus = (p, q) => p.map((value, i) => value - q[i]);
const along = (p, q, t) => p.map((value, i) => value + t * (q[i] - value));

/** Height above the ellipsoid, metres, by iteration. */
function height([x, y, z]) {
  const p = Math.hypot(x, y);
  let latitude = Math.atan2(z, p * (1 - e2));
  let n = a;
  for (let i = 0; i < 6; ++i) {
    n = a / Math.sqrt(1 - e2 * Math.sin(latitude) ** 2);
    latitude = Math.atan2(z + e2 * n * Math.sin(latitude), p);
  }
  return p * Math.cos(latitude) + z * Math.sin(latitude) - (a * a) / n;
}

function verticesOf(file) {
  const { json, bytesOf } = readGlb(join(folder, file));
  const [tx, ty, tz] = json.nodes[0].translation;
  const accessor = json.accessors[json.meshes[0].primitives[0].attributes.POSITION];
  if (json.bufferViews[accessor.bufferView].extensions) return undefined; // compressed
  const values = new Float32Array(bytesOf(accessor.bufferView));
  const vertices = [];
  // y up to z up
  for (let i = 0; i < values.length; i += 3)
    vertices.push([values[i] + tx, -(values[i + 2] + tz), values[i + 1] + ty]);
  return vertices;
}

/** As engines test it, in the space where the ellipsoid is the unit sphere. */
function isHidden(point, cameraEcef) {
  const camera = [cameraEcef[0] / a, cameraEcef[1] / a, cameraEcef[2] / b];
  const horizon = dot(camera, camera) - 1;
  const way = minus(point, camera);
  const behind = -dot(way, camera);
  if (horizon < 0) return behind > 0;
  return behind > horizon && (behind * behind) / dot(way, way) > horizon;
}

function leastHeight(from, to) {
  let low = 0;
  let high = 1;
  for (let i = 0; i < 40; ++i) {
    const third = (high - low) / 3;
    if (height(along(from, to, low + third)) < height(along(from, to, high - third))) high -= third;
    else low += third;
  }
  return height(along(from, to, (low + high) / 2));
}

// Numbers that are the same in every run.
let state = 1;
const random = () => (state = (state * 48271) % 2147483647) / 2147483647;

const byPlace = new Map(tiles.map((tile) => [`${tile.level}/${tile.x}/${tile.y}`, tile]));
const depth = Math.max(0, ...tiles.map((tile) => -tile.metadata.minimumHeight));
let rays = 0;
let hidden = 0;
for (const tile of tiles.filter((t) => t.hasContent)) {
  const vertices = verticesOf(tile.file);
  if (!vertices) continue;
  for (let above = tile; above; ) {
    const { boundingBox: box, minimumHeight, maximumHeight, geometricError } = above.metadata;
    const centre = box.slice(0, 3);
    for (const v of vertices) {
      for (let axis = 3; axis < 12; axis += 3) {
        const half = box.slice(axis, axis + 3);
        if (Math.abs(dot(minus(v, centre), half)) > dot(half, half)) fault(`${above.file}: box leaves out ground of ${tile.file}`);
      }
    }
    for (let i = 0; i < vertices.length; i += 7) {
      const h = height(toEcef(vertices[i]));
      if (h < minimumHeight - 0.001 || h > maximumHeight + 0.001) fault(`${above.file}: heights leave out ${h} of ${tile.file}`);
    }
    if (geometricError < tile.metadata.geometricError) fault(`${above.file}: better than ${tile.file}`);
    above = byPlace.get(`${above.level - 1}/${above.x >> 1}/${above.y >> 1}`);
  }
  const point = Array.from(tile.metadata.horizonOcclusionPoint);
  if (point[2] === 1e12) continue;
  const middle = toEcef(Array.from(tile.metadata.boundingBox.slice(0, 3)));
  const up = [middle[0] / a / a, middle[1] / a / a, middle[2] / b / b];
  for (let i = 0; i < 40; ++i) {
    // Cameras around the horizon, at heights up to the edge of space.
    const side = minus([random() - 0.5, random() - 0.5, random() - 0.5], [0, 0, 0]);
    const level = minus(side, up.map((u) => (u * dot(side, up)) / dot(up, up)));
    const length = Math.hypot(...level);
    const high = Math.exp(random() * 11);
    const angle =
      (Math.acos(Math.min(1, 1 / Math.sqrt(dot(point, point)))) + Math.acos(a / (a + high))) * (0.97 + 0.15 * random());
    const unit = middle.map((value) => value / Math.hypot(...middle));
    const direction = unit.map((u, k) => u * Math.cos(angle) + (level[k] / length) * Math.sin(angle));
    const camera = [direction[0] * (a + high), direction[1] * (a + high), direction[2] * (b + high)];
    if (!isHidden(point, camera)) continue;
    ++hidden;
    for (let v = 0; v < vertices.length; v += 23, ++rays)
      if (leastHeight(camera, toEcef(vertices[v])) > -depth + 0.001) fault(`${tile.file}: seen past its horizon point`);
  }
}
console.log(`${tiles.length} tiles; ${hidden} cameras beyond horizons, ${rays} rays; ${faults} faults`);
if (faults) process.exit(1);
