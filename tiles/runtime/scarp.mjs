// Scarp at run time: which groups of a terrain a camera cannot see, from one file.
//
//   const culling = await open('alps.scarp');          // node; or open(bytes) anywhere
//   const camera = culling.camera(x, y, z);            // ECEF, metres (EPSG:4978)
//   const frustum = culling.frustum(camera, planes);   // may be left out
//   const count = culling.visible(camera, frustum, groups);
//
// The same answers as scarp_runtime.h, bit for bit, and for the same reasons: see there. Every
// number after the camera is an integer below 2^53. docs/runtime.md has the file's bytes.
// What is not among the visible groups is hidden for certain; what is may be hidden.

const HEADER_BYTES = 256;
const SECTIONS = 13;
const BLOCK_GROUPS = 32;
const REACH = 2147483000;
const MOST_PARTS = 67108864; // 2^26
const LEAST_PARTS = 131072; // 2^17
const RATIO_ONE = 65536;
const MOST_RATIO = 33554431; // 2^25 - 1
const ONE = 131072; // of tangents and eighths, 2^17
const SECTOR_A = 166855 * ONE;
const SECTOR_B = 35783;
const SLOPE_ONE = 1048576; // 2^20
const NO_HEIGHT = -32768;
const MOST_PLANES = 8;

export const UNKNOWN = 0;
export const OCCLUDED = 1;
export const NOT_OCCLUDED = 2;
const HAS_ORPHANS = 1;
const IS_FINEST = 2;

export class ScarpFileError extends Error {
  // code: 'not-ours', 'version', 'damaged', 'big-endian'
  constructor(code, message) {
    super(message);
    this.name = 'ScarpFileError';
    this.code = code;
  }
}

const damaged = (what) =>
  new ScarpFileError('damaged', `the file is damaged: ${what}; export it again`);

let crcTables;
function makeCrcTables() {
  const tables = [];
  for (let t = 0; t < 4; ++t) tables.push(new Int32Array(256));
  for (let i = 0; i < 256; ++i) {
    let crc = i;
    for (let bit = 0; bit < 8; ++bit) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
    tables[0][i] = crc;
  }
  for (let i = 0; i < 256; ++i)
    for (let t = 1; t < 4; ++t)
      tables[t][i] = (tables[t - 1][i] >>> 8) ^ tables[0][tables[t - 1][i] & 255];
  return tables;
}

// CRC-32 of bytes, four at a time. `from` is a multiple of 4.
function crcOf(bytes, from, size) {
  crcTables ??= makeCrcTables();
  const [t0, t1, t2, t3] = crcTables;
  const words = size >>> 2;
  const view = new Int32Array(bytes.buffer, bytes.byteOffset + from, words);
  let crc = -1;
  for (let i = 0; i < words; ++i) {
    crc ^= view[i];
    crc = t3[crc & 255] ^ t2[(crc >>> 8) & 255] ^ t1[(crc >>> 16) & 255] ^ t0[crc >>> 24];
  }
  for (let i = from + 4 * words; i < from + size; ++i)
    crc = (crc >>> 8) ^ t0[(crc ^ bytes[i]) & 255];
  return ~crc >>> 0;
}

function powerOf2(exponent) {
  let power = 1;
  for (let i = 0; i < exponent; ++i) power *= 2;
  return power;
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// A camera that is out of reach: it sees everything.
const NO_CAMERA = Object.freeze({
  x: 0, y: 0, z: 0, zStraight: 0, exactX: 0, exactY: 0, exactZStraight: 0, isValid: false,
});
const NO_BOX = Object.freeze({ lowX: 0, lowY: 0, highX: 0, highY: 0, top: 0, isValid: false });

// Opens a file by its name (node), or bytes: an ArrayBuffer, or a view of one. The bytes are kept.
// options.check: 'everything' (all checksums) or 'structure' (header and tiles only).
// Throws ScarpFileError.
export async function open(source, options = {}) {
  if (typeof source !== 'string') return new Culling(source, options);
  const { readFile } = await import('node:fs/promises');
  return new Culling(await readFile(source), options);
}

export class Culling {
  constructor(source, { check = 'everything' } = {}) {
    if (new Uint8Array(Uint16Array.of(1).buffer)[0] !== 1)
      throw new ScarpFileError('big-endian', 'this machine is big-endian, the file is not');
    let bytes = ArrayBuffer.isView(source)
      ? new Uint8Array(source.buffer, source.byteOffset, source.byteLength)
      : new Uint8Array(source);
    if (bytes.byteOffset % 8 !== 0) bytes = bytes.slice();
    this.#readHeader(bytes);
    this.#placeSections(bytes, check === 'everything');
    this.#checkTiles();
    // Memory of answers, made once.
    this.hidden = new Uint8Array(64);
    this.aim = { x: 0, y: 0, z: 0, parts: 1, units: 1 };
    this.look = { distance: 0, ratio: 0, sector: 0, ring: 0, turn: 0, isNear: false };
  }

  #readHeader(bytes) {
    const magic = 'SCARPGRP';
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    for (let i = 0; i < 8; ++i)
      if (bytes.length < 16 || bytes[i] !== magic.charCodeAt(i))
        throw new ScarpFileError('not-ours', 'this is no file of scarp export --to groups');
    const u32 = (at) => view.getUint32(at, true);
    const i32 = (at) => view.getInt32(at, true);
    if (u32(8) !== 2)
      throw new ScarpFileError('version', `the file has version ${u32(8)}; 2 was expected`);
    if (bytes.length < HEADER_BYTES) throw damaged('it ends within its header');
    if (u32(252) !== crcOf(bytes, 0, 252)) throw damaged('the checksum of its header is wrong');
    if (u32(12) !== HEADER_BYTES || u32(16) !== bytes.length || u32(20) !== 0 || u32(244) !== 0 ||
        u32(248) !== 0)
      throw damaged('its size is wrong');
    this.groups = u32(24);
    this.tiles = u32(28);
    this.sectors = u32(32);
    this.ringBits = u32(36);
    const unitBits = u32(40);
    const earth = u32(44);
    const vector = (at) => [0, 8, 16].map((i) => view.getFloat64(at + i, true));
    this.origin = vector(48);
    this.east = vector(72);
    this.north = vector(96);
    this.up = vector(120);
    this.scaleM = view.getFloat64(144, true);
    this.bendM = view.getFloat64(152, true);
    this.firstColumn = i32(160);
    this.firstRow = i32(164);
    this.columns = u32(168);
    this.rows = u32(172);
    const cellBits = u32(176);
    this.base = i32(180);
    const heightBits = u32(184);
    this.highest = i32(188);
    const numbers = [...this.origin, ...this.east, ...this.north, ...this.up];
    if (this.groups > 2 ** 28 || this.tiles > 2 ** 24 || this.sectors < 8 || this.sectors > 4096 ||
        this.sectors % 8 !== 0 || (this.ringBits !== 2 && this.ringBits !== 3) || unitBits > 16 ||
        earth > 1 || !numbers.every(Number.isFinite) || !(this.scaleM > 0) ||
        !Number.isFinite(this.scaleM) || !(this.bendM >= 0) || !Number.isFinite(this.bendM) ||
        this.columns > 32768 || this.rows > 32768 || cellBits > 30 || heightBits > 16 ||
        (this.columns === 0) !== (this.rows === 0))
      throw damaged('a number of its header is out of range');
    this.isFlat = earth === 0;
    this.unitsPerM = powerOf2(unitBits);
    this.cell = powerOf2(cellBits);
    this.heightStep = powerOf2(heightBits);
    this.crcs = Array.from({ length: SECTIONS }, (_, i) => u32(192 + 4 * i));
  }

  #placeSections(bytes, check) {
    const n = this.groups;
    let cells = 0;
    for (let c = this.columns, r = this.rows; c > 0; c = (c + 1) >>> 1, r = (r + 1) >>> 1) {
      cells += c * r;
      if (c === 1 && r === 1) break;
    }
    const blocks = Math.ceil(n / BLOCK_GROUPS);
    const sizes = [this.tiles * 64, n * 4, n * 4, n * 4, n * 4, n * 4, n * 4, n * 4, n * 4, n * 24,
      blocks * 24, n * this.sectors * 16, cells * 2];
    const begins = [];
    let at = HEADER_BYTES;
    for (let i = 0; i < SECTIONS; ++i) {
      const begin = Math.ceil(at / 64) * 64;
      if (begin + sizes[i] > bytes.length) throw damaged('it ends too early');
      for (; at < begin; ++at) if (bytes[at] !== 0) throw damaged('bytes between sections are set');
      begins.push(begin);
      at = begin + sizes[i];
      if ((check || i === 0) && this.crcs[i] !== crcOf(bytes, begin, sizes[i]))
        throw damaged(`the checksum of section ${i} is wrong`);
    }
    if (at !== bytes.length) throw damaged('it ends too late');
    const place = (Type, i) => new Type(bytes.buffer, bytes.byteOffset + begins[i],
      sizes[i] / Type.BYTES_PER_ELEMENT);
    this.tile = place(Int32Array, 0);
    this.x = place(Int32Array, 1);
    this.y = place(Int32Array, 2);
    this.height = place(Int32Array, 3);
    this.inverse = place(Float32Array, 4);
    this.low = place(Int32Array, 5);
    this.step = place(Uint32Array, 6);
    this.ids = place(Uint32Array, 7);
    this.triangles = place(Uint32Array, 8);
    this.boxes = place(Int32Array, 9);
    this.blocks = place(Int32Array, 10);
    this.steps = place(Uint16Array, 11);
    this.least = place(Int16Array, 12);
  }

  #checkTiles() {
    let next = 0;
    for (let t = 0; t < this.tiles; ++t) {
      const tile = this.tileAt(t);
      let sound = tile.level <= 30 && tile.flags <= (HAS_ORPHANS | IS_FINEST) &&
        tile.firstGroup + tile.groups <= this.groups;
      for (let axis = 0; axis < 3; ++axis) sound &&= tile.low[axis] <= tile.high[axis];
      if (sound && tile.flags & IS_FINEST) {
        sound = tile.firstGroup === next;
        next += tile.groups;
      }
      if (!sound) throw damaged(`tile ${t} is wrong`);
    }
    if (next !== this.groups) throw damaged('its tiles do not hold its groups');
  }

  // A tile of the scene: groups [firstGroup, firstGroup + groups) of the file lie in it.
  tileAt(t) {
    const at = (i) => this.tile[t * 16 + i];
    return {
      level: at(0) >>> 0, column: at(1) >>> 0, row: at(2) >>> 0, flags: at(3) >>> 0,
      firstGroup: at(4) >>> 0, groups: at(5) >>> 0,
      low: [at(6), at(7), at(8)], high: [at(9), at(10), at(11)],
      inner: [at(12), at(13), at(14), at(15)],
    };
  }

  get unitM() {
    return 1 / this.unitsPerM;
  }

  // x, y, z and z without refraction, metres; null where it is out of reach.
  #toFrame(x, y, z) {
    const from = [x - this.origin[0], y - this.origin[1], z - this.origin[2]];
    if (this.isFlat) return [from[0], from[1], from[2], from[2]];
    const height = dot(from, this.up);
    if (!(height > 0)) return null;
    const u = dot(from, this.east) / height;
    const v = dot(from, this.north) / height;
    const square = u * u + v * v;
    const bend = this.bendM * square / (Math.sqrt(1 + square) + 1);
    const straight = this.scaleM * ((height - this.scaleM) / height);
    return [this.scaleM * u, this.scaleM * v, straight + bend, straight];
  }

  #roundedCamera(x, y, z, zStraight) {
    const exactX = x * this.unitsPerM;
    const exactY = y * this.unitsPerM;
    const exactZ = z * this.unitsPerM;
    const exactZStraight = zStraight * this.unitsPerM;
    if (!(Math.abs(exactX) < REACH && Math.abs(exactY) < REACH && Math.abs(exactZ) < REACH &&
          Math.abs(exactZStraight) < REACH))
      return NO_CAMERA;
    return {
      x: Math.floor(exactX + 0.5), y: Math.floor(exactY + 0.5), z: Math.floor(exactZ) + 2,
      zStraight: Math.floor(exactZStraight + 0.5), exactX, exactY, exactZStraight, isValid: true,
    };
  }

  // The camera at a place: ECEF metres; of a flat scene metres of the map.
  camera(x, y, z) {
    const place = this.#toFrame(x, y, z);
    return place === null ? NO_CAMERA : this.#roundedCamera(...place);
  }

  // The camera at a place of the flattened frame, metres.
  cameraInFrame(xM, yM, zM) {
    let zStraightM = zM;
    if (!this.isFlat) {
      const u = xM / this.scaleM;
      const v = yM / this.scaleM;
      const square = u * u + v * v;
      zStraightM = zM - this.bendM * square / (Math.sqrt(1 + square) + 1);
    }
    return this.#roundedCamera(xM, yM, zM, zStraightM);
  }

  // What a view shows: half-spaces a x + b y + c z + d >= 0 of the coordinates that camera() takes,
  // as numbers a, b, c, d one plane after the other; at most 8 count. Rounded outwards.
  frustum(camera, planes) {
    const result = [];
    for (let i = 0; i + 3 < planes.length && i < 4 * MOST_PLANES; i += 4) {
      const plane = [planes[i], planes[i + 1], planes[i + 2]];
      const atOrigin = dot(plane, this.origin) + planes[i + 3];
      let [a, b, c] = plane;
      let d = atOrigin;
      if (!this.isFlat) {
        a = dot(plane, this.east);
        b = dot(plane, this.north);
        c = -atOrigin / this.scaleM;
        d = this.scaleM * dot(plane, this.up) + atOrigin;
      }
      const greatest = Math.max(Math.abs(a), Math.abs(b), Math.abs(c));
      if (!(greatest > 0) || !Number.isFinite(greatest) || !camera.isValid) continue;
      const by = 131072 / greatest;
      const sum = a * camera.exactX + b * camera.exactY + c * camera.exactZStraight +
        d * this.unitsPerM;
      const atCamera = Math.floor(sum * by + 0.5);
      const far = 1125899906842624; // 2^50
      if (!(atCamera > -far)) continue;
      result.push({
        a: Math.floor(a * by + 0.5), b: Math.floor(b * by + 0.5), c: Math.floor(c * by + 0.5),
        atCamera: Math.min(atCamera, far),
      });
    }
    return result;
  }

  #isOutside(camera, frustum, boxes, box) {
    const at = box * 6;
    const lowX = boxes[at] - camera.x;
    const lowY = boxes[at + 1] - camera.y;
    const lowZ = boxes[at + 2] - camera.zStraight;
    const highX = boxes[at + 3] - camera.x;
    const highY = boxes[at + 4] - camera.y;
    const highZ = boxes[at + 5] - camera.zStraight;
    const reach = Math.max(Math.abs(lowX), Math.abs(highX)) +
      Math.max(Math.abs(lowY), Math.abs(highY)) + Math.max(Math.abs(lowZ), Math.abs(highZ));
    for (let i = 0; i < frustum.length; ++i) {
      const p = frustum[i];
      const best = p.atCamera + p.a * (p.a >= 0 ? highX : lowX) + p.b * (p.b >= 0 ? highY : lowY) +
        p.c * (p.c >= 0 ? highZ : lowZ);
      if (2 * best + reach + 786432 < 0) return true;
    }
    return false;
  }

  _aimAt(camera, t) {
    const aim = this.aim;
    const tile = this.tile;
    const at = t * 16;
    aim.x = camera.x;
    aim.y = camera.y;
    aim.z = camera.z;
    aim.parts = 1;
    aim.units = 1;
    const farthest = Math.max(Math.abs(camera.x - tile[at + 6]), Math.abs(camera.x - tile[at + 9]),
      Math.abs(camera.y - tile[at + 7]), Math.abs(camera.y - tile[at + 10]));
    while (farthest * aim.parts >= MOST_PARTS) {
      aim.parts *= 0.5;
      aim.units *= 2;
    }
    return aim;
  }

  // Where the camera of an aim stands as seen from a group: this.look.
  _lookAt(aim, group) {
    const look = this.look;
    const dx = aim.x - this.x[group];
    const dy = aim.y - this.y[group];
    const x = Math.min(Math.abs(dx) * aim.parts, MOST_PARTS) | 0;
    const y = Math.min(Math.abs(dy) * aim.parts, MOST_PARTS) | 0;
    const distance = Math.sqrt(x * x + y * y) | 0;
    let exactRatio = distance * aim.units * this.inverse[group];
    exactRatio = exactRatio < MOST_RATIO ? exactRatio : MOST_RATIO;
    const ratio = exactRatio > 0 ? exactRatio | 0 : 0;
    look.distance = distance;
    look.ratio = ratio;
    look.isNear = !(distance >= LEAST_PARTS && ratio >= RATIO_ONE);
    const greater = y > x ? y : x;
    const lesser = y > x ? x : y;
    const tangent = (lesser * ONE / (greater > 1 ? greater : 1)) | 0;
    const eighth = (tangent * (SECTOR_A - SECTOR_B * tangent) / 17179869184) | 0;
    const quarter = y > x ? 2 * ONE - eighth : eighth;
    const half = dx < 0 ? 4 * ONE - quarter : quarter;
    const turn = dy < 0 ? 8 * ONE - half : half;
    look.turn = turn;
    const sector = (turn * (this.sectors >>> 3) / ONE) | 0;
    look.sector = sector < this.sectors ? sector : 0;
    if (look.isNear) {
      look.ring = 0;
    } else {
      const square = (ratio * ratio / 1048576) | 0;
      const exponent = 31 - Math.clz32(square);
      const ring = (square >>> (exponent - this.ringBits)) - (1 << this.ringBits) +
        ((exponent - 12) << this.ringBits);
      look.ring = ring < 63 ? ring : 63;
    }
    return look;
  }

  // The code of the last step that is not beyond the ring; 0: nothing is hidden.
  _codeAt(group, sector, ring) {
    const steps = this.steps;
    const at = (group * this.sectors + sector) * 8;
    const last = (ring << 10) | 1023;
    let code = 0;
    if (steps[at] <= last) code = steps[at];
    if (steps[at + 1] <= last) code = steps[at + 1];
    if (steps[at + 2] <= last) code = steps[at + 2];
    if (steps[at + 3] <= last) code = steps[at + 3];
    if (steps[at + 4] <= last) code = steps[at + 4];
    if (steps[at + 5] <= last) code = steps[at + 5];
    if (steps[at + 6] <= last) code = steps[at + 6];
    if (steps[at + 7] <= last) code = steps[at + 7];
    return code & 1023;
  }

  // 2^-20
  _slopeOf(group, code) {
    return this.low[group] + Math.floor((code - 1) * this.step[group] / 1024);
  }

  _hides(aim, group) {
    const look = this._lookAt(aim, group);
    if (look.isNear) return false;
    const code = this._codeAt(group, look.sector, look.ring);
    if (code === 0) return false;
    const slope = this._slopeOf(group, code);
    const safe = slope >= 0 ? look.distance - 3 : look.distance + 4;
    return (aim.z - this.height[group]) * SLOPE_ONE < slope * safe * aim.units;
  }

  // Whether one group of the file is hidden.
  hides(camera, group) {
    if (!camera.isValid) return false;
    for (let t = 0; t < this.tiles; ++t) {
      const tile = this.tileAt(t);
      if (!(tile.flags & IS_FINEST) || group < tile.firstGroup ||
          group >= tile.firstGroup + tile.groups)
        continue;
      return this._hides(this._aimAt(camera, t), group);
    }
    return false;
  }

  // Adds groups [first, end) that are not hidden and may be in the frustum.
  _show(camera, frustum, first, end, hidden, visible, found) {
    const ids = this.ids;
    const hasFrustum = frustum && frustum.length > 0;
    let block = -1;
    let isBlockOutside = false;
    for (let g = first; g < end; ++g) {
      if (hidden[g - first]) continue;
      if (hasFrustum) {
        if (g >>> 5 !== block) {
          block = g >>> 5;
          isBlockOutside = this.#isOutside(camera, frustum, this.blocks, block);
        }
        if (isBlockOutside || this.#isOutside(camera, frustum, this.boxes, g)) continue;
      }
      visible[found++] = ids[g];
    }
    return found;
  }

  // Groups that may be seen, by their numbers in the scene, in the order of the file: written to
  // `visible`, a Uint32Array of at least `groups`. Returns how many. frustum: null for all around.
  visible(camera, frustum, visible) {
    let found = 0;
    const hidden = this.hidden;
    for (let t = 0; t < this.tiles; ++t) {
      const at = t * 16;
      if (!(this.tile[at + 3] & IS_FINEST)) continue;
      const aim = this._aimAt(camera, t);
      const begin = this.tile[at + 4] >>> 0;
      const end = begin + (this.tile[at + 5] >>> 0);
      for (let first = begin; first < end; first += 64) {
        const last = Math.min(first + 64, end);
        if (camera.isValid)
          for (let g = first; g < last; ++g) hidden[g - first] = this._hides(aim, g) ? 1 : 0;
        else hidden.fill(0);
        found = this._show(camera, frustum, first, last, hidden, visible, found);
      }
    }
    return found;
  }

  // UNKNOWN, OCCLUDED or NOT_OCCLUDED.
  tileAnswer(camera, t) {
    if (!camera.isValid) return UNKNOWN;
    const tile = this.tileAt(t);
    const [lowX, lowY, highX, highY] = tile.inner;
    if (camera.x > lowX && camera.x < highX && camera.y > lowY && camera.y < highY &&
        camera.z - 3 > tile.high[2])
      return NOT_OCCLUDED;
    const box = {
      lowX: tile.low[0], lowY: tile.low[1], highX: tile.high[0], highY: tile.high[1],
      top: tile.high[2], isValid: true,
    };
    if (!this.boxVisible(camera, box)) return OCCLUDED;
    if (!(tile.flags & IS_FINEST) || tile.flags & HAS_ORPHANS || tile.groups === 0) return UNKNOWN;
    const aim = this._aimAt(camera, t);
    for (let g = tile.firstGroup; g < tile.firstGroup + tile.groups; ++g)
      if (!this._hides(aim, g)) return UNKNOWN;
    return OCCLUDED;
  }

  boxInFrame(lowXM, lowYM, highXM, highYM, topM) {
    const lowX = Math.floor(lowXM * this.unitsPerM) - 1;
    const lowY = Math.floor(lowYM * this.unitsPerM) - 1;
    const highX = Math.floor(highXM * this.unitsPerM) + 2;
    const highY = Math.floor(highYM * this.unitsPerM) + 2;
    const top = Math.floor(topM * this.unitsPerM) + 2;
    if (!(lowX > -REACH && lowY > -REACH && highX < REACH && highY < REACH && lowX <= highX &&
          lowY <= highY && Math.abs(top) < REACH))
      return NO_BOX;
    return { lowX, lowY, highX, highY, top, isValid: true };
  }

  // The least box of the frame that holds an object's corners: x, y, z of one after the other.
  box(corners) {
    if (corners.length < 3) return NO_BOX;
    const low = [Infinity, Infinity];
    const high = [-Infinity, -Infinity];
    let top = -Infinity;
    let bend = 0;
    for (let i = 0; i + 2 < corners.length; i += 3) {
      const place = this.#toFrame(corners[i], corners[i + 1], corners[i + 2]);
      if (place === null) return NO_BOX;
      for (let axis = 0; axis < 2; ++axis) {
        low[axis] = Math.min(low[axis], place[axis]);
        high[axis] = Math.max(high[axis], place[axis]);
      }
      top = Math.max(top, place[3]);
      bend = Math.max(bend, place[2] - place[3]);
    }
    return this.boxInFrame(low[0], low[1], high[0], high[1], top + bend);
  }

  #isGroundAbove(lowX, lowY, highX, highY, height) {
    let columns = this.columns;
    let rows = this.rows;
    let begin = 0;
    let left = Math.floor(lowX / this.cell) - this.firstColumn;
    let right = Math.floor(highX / this.cell) - this.firstColumn;
    let below = Math.floor(lowY / this.cell) - this.firstRow;
    let above = Math.floor(highY / this.cell) - this.firstRow;
    if (!(left >= 0 && below >= 0 && right < columns && above < rows)) return false;
    while ((right - left > 3 || above - below > 3) && (columns > 1 || rows > 1)) {
      begin += columns * rows;
      columns = (columns + 1) >>> 1;
      rows = (rows + 1) >>> 1;
      left = Math.floor(left / 2);
      right = Math.floor(right / 2);
      below = Math.floor(below / 2);
      above = Math.floor(above / 2);
    }
    for (let row = below; row <= above; ++row)
      for (let column = left; column <= right; ++column) {
        const code = this.least[begin + row * columns + column];
        if (code === NO_HEIGHT || !(this.base + code * this.heightStep > height)) return false;
      }
    return true;
  }

  // Whether something in a box may be seen: false only where ground hides all of it for certain.
  boxVisible(camera, box) {
    return this.boxVisibleFromCell({
      lowX: camera.x, lowY: camera.y, highX: camera.x, highY: camera.y, top: camera.z,
      isValid: camera.isValid,
    }, box);
  }

  // The same from every camera in a cell, a box: in its plan, and not above its top.
  boxVisibleFromCell(cell, box) {
    if (!cell.isValid || !box.isValid || this.columns === 0) return true;
    const top = this.base + this.highest * this.heightStep;
    const wayX = box.lowX + box.highX - (cell.lowX + cell.highX);
    const wayY = box.lowY + box.highY - (cell.lowY + cell.highY);
    const way = Math.max(Math.abs(wayX), Math.abs(wayY)) / (2 * this.cell);
    const parts = Math.min(Math.floor(way) + 2, 4096);
    for (let part = parts - 1; part >= 1; --part) {
      const rest = parts - part;
      const height = Math.floor((cell.top * rest + box.top * part) / parts) + 1;
      if (height >= top) continue;
      if (this.#isGroundAbove(Math.floor((cell.lowX * rest + box.lowX * part) / parts) - 1,
        Math.floor((cell.lowY * rest + box.lowY * part) / parts) - 1,
        Math.floor((cell.highX * rest + box.highX * part) / parts) + 2,
        Math.floor((cell.highY * rest + box.highY * part) / parts) + 2, height))
        return false;
    }
    return true;
  }
}

// The same answers as Culling.visible for a camera that moves: a group is looked at again only when
// the camera has gone so far that its answer can have changed.
export class MovingView {
  constructor(culling) {
    this.culling = culling;
    this.until = new Float64Array(culling.groups);
    this.isHidden = new Uint8Array(culling.groups);
    this.units = new Float64Array(culling.tiles);
    this.last = NO_CAMERA;
    this.travelled = 0;
    this.lookedAt = 0;
  }

  // How far, in units along each axis, the camera may go before a group's answer can change.
  #lookAgain(aim, group) {
    const c = this.culling;
    const look = c._lookAt(aim, group);
    const aPart = aim.units * c.inverse[group];
    this.isHidden[group] = 0;
    let free = 0;
    if (look.isNear) {
      free = Math.max(LEAST_PARTS - look.distance, (RATIO_ONE - look.ratio - 1) / aPart) / 1.5 - 3;
    } else {
      const sectors = c.sectors >>> 3;
      const turned = look.turn * sectors;
      const past = turned % ONE;
      const turn = Math.min(past, ONE - past) / sectors;
      free = (turn - 5) * look.distance / 327680 - 2;
      free = Math.min(free, (look.distance - LEAST_PARTS) / 1.5 - 2);
      const square = look.ratio * look.ratio;
      const rings = 1 << c.ringBits;
      const octave = powerOf2(32 + (look.ring >>> c.ringBits));
      const place = look.ring & (rings - 1);
      const begin = octave * (1 + place / rings);
      const end = look.ring === 63 ? square * 1.125 : octave * (1 + (place + 1) / rings);
      const ratio = Math.min(square - begin, end - square - 1) / (2.125 * look.ratio);
      free = Math.min(free, ((ratio - 1) / aPart - 3) / 1.5);
      const code = c._codeAt(group, look.sector, look.ring);
      if (code !== 0) {
        const slope = c._slopeOf(group, code);
        const safe = slope >= 0 ? look.distance - 3 : look.distance + 4;
        const rise = (aim.z - c.height[group]) * SLOPE_ONE;
        const line = slope * safe * aim.units;
        this.isHidden[group] = rise < line ? 1 : 0;
        const gap = Math.abs(rise - line) / aim.units;
        const steep = Math.abs(slope);
        free = Math.min(free, (gap - 3 * steep) / (SLOPE_ONE + 1.5 * steep) - 1);
      }
    }
    return free > 0 ? free * aim.units : 0;
  }

  visible(camera, frustum, visible) {
    const c = this.culling;
    this.lookedAt = 0;
    if (!camera.isValid) return c.visible(camera, frustum, visible);
    this.travelled += Math.max(Math.abs(camera.x - this.last.x), Math.abs(camera.y - this.last.y),
      Math.abs(camera.z - this.last.z));
    this.last = camera;
    const travelled = this.travelled;
    let found = 0;
    for (let t = 0; t < c.tiles; ++t) {
      const at = t * 16;
      if (!(c.tile[at + 3] & IS_FINEST)) continue;
      const aim = c._aimAt(camera, t);
      const isNew = this.units[t] !== aim.units;
      this.units[t] = aim.units;
      const begin = c.tile[at + 4] >>> 0;
      const end = begin + (c.tile[at + 5] >>> 0);
      for (let g = begin; g < end; ++g)
        if (isNew || !(travelled <= this.until[g])) {
          ++this.lookedAt;
          this.until[g] = travelled + this.#lookAgain(aim, g);
        }
      found = c._show(camera, frustum, begin, end, this.isHidden.subarray(begin, end), visible,
        found);
    }
    return found;
  }
}
