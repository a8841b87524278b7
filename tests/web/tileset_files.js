// Reads a folder that `scarp export --to 3dtiles` made, by the words of the 3D Tiles 1.1 and glTF 2.0 specifications
// and nothing of Scarp's: for the checks beside this file.
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";

export function filesBelow(folder, ending) {
  return readdirSync(folder, { recursive: true })
    .map(String)
    .filter((name) => name.endsWith(ending))
    .sort();
}

export function readTileset(folder) {
  return JSON.parse(readFileSync(join(folder, "tileset.json"), "utf8"));
}

/** A .subtree: its JSON, and bytes of its buffer views. */
export function readSubtree(path) {
  const bytes = readFileSync(path);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (view.getUint32(0, true) !== 0x74627573 || view.getUint32(4, true) !== 1) throw new Error(`${path}: no subtree`);
  const jsonLength = Number(view.getBigUint64(8, true));
  const binaryLength = Number(view.getBigUint64(16, true));
  if (jsonLength % 8 || binaryLength % 8) throw new Error(`${path}: chunks not in multiples of 8`);
  if (24 + jsonLength + binaryLength !== bytes.length) throw new Error(`${path}: chunks do not fill the file`);
  const json = JSON.parse(bytes.toString("utf8", 24, 24 + jsonLength));
  const start = bytes.byteOffset + 24 + jsonLength;
  if ((24 + jsonLength) % 8) throw new Error(`${path}: buffer not at a multiple of 8`);
  if (json.buffers.length !== 1 || json.buffers[0].byteLength !== binaryLength)
    throw new Error(`${path}: buffer is not as long as it says`);
  const bytesOf = (index) => {
    const { byteOffset, byteLength } = json.bufferViews[index];
    if (byteOffset % 8) throw new Error(`${path}: buffer view ${index} not at a multiple of 8`);
    if (byteOffset + byteLength > binaryLength) throw new Error(`${path}: buffer view ${index} ends behind the buffer`);
    return bytes.buffer.slice(start + byteOffset, start + byteOffset + byteLength);
  };
  return { json, bytesOf };
}

/** Whether bit `index` of an availability is set. */
export function isAvailable(subtree, availability, index) {
  if ("constant" in availability) return availability.constant === 1;
  const bytes = new Uint8Array(subtree.bytesOf(availability.bitstream));
  return ((bytes[index >> 3] >> (index & 7)) & 1) === 1;
}

export function morton(x, y) {
  let code = 0;
  for (let bit = 0; bit < 24; ++bit) code += ((x >> bit) & 1) * 4 ** bit + ((y >> bit) & 1) * 2 * 4 ** bit;
  return code;
}

const arrays = { FLOAT64: Float64Array, FLOAT32: Float32Array, UINT32: Uint32Array };
const widths = { SCALAR: 1, VEC2: 2, VEC3: 3 };

/** The rows of a property table: an object a row. `bytesOf` gives the bytes of a buffer view. */
export function readTable(table, schema, bytesOf) {
  const properties = schema.classes[table.class].properties;
  const rows = Array.from({ length: table.count }, () => ({}));
  for (const [name, property] of Object.entries(properties)) {
    if (!(name in table.properties)) continue;
    const width = widths[property.type] * (property.array ? property.count : 1);
    const values = new arrays[property.componentType](bytesOf(table.properties[name].values));
    if (values.length !== width * table.count)
      throw new Error(`property ${name}: ${values.length} numbers for ${table.count} rows of ${width}`);
    rows.forEach((row, i) => (row[name] = width === 1 ? values[i] : values.slice(i * width, (i + 1) * width)));
  }
  return rows;
}

/** All tiles of an implicit quadtree: place, whether it has content, the row of tile and content metadata. */
export function readTiles(folder, tileset = readTileset(folder)) {
  const { subtreeLevels, availableLevels } = tileset.root.implicitTiling;
  const tiles = [];
  const visit = (level, x, y) => {
    const subtree = readSubtree(join(folder, `subtrees/${level}/${x}/${y}.subtree`));
    const { json } = subtree;
    const rows = readTable(json.propertyTables[json.tileMetadata], tileset.schema, subtree.bytesOf);
    const contentRows =
      json.contentMetadata === undefined
        ? undefined
        : readTable(json.propertyTables[json.contentMetadata[0]], tileset.schema, subtree.bytesOf);
    let row = 0;
    let contentRow = 0;
    for (let depth = 0, first = 0; depth < subtreeLevels; first += 4 ** depth, ++depth) {
      const places = [];
      for (let dx = 0; dx < 2 ** depth; ++dx)
        for (let dy = 0; dy < 2 ** depth; ++dy) places.push({ dx, dy, index: first + morton(dx, dy) });
      places.sort((a, b) => a.index - b.index);
      for (const { dx, dy, index } of places) {
        if (!isAvailable(subtree, json.tileAvailability, index)) continue;
        if (level + depth >= availableLevels) throw new Error("a tile beyond the available levels");
        const hasContent = isAvailable(subtree, json.contentAvailability[0], index);
        const place = { level: level + depth, x: x * 2 ** depth + dx, y: y * 2 ** depth + dy };
        tiles.push({
          ...place,
          hasContent,
          file: `tiles/${place.level}/${place.x}/${place.y}.glb`,
          metadata: rows[row++],
          horizon: hasContent && contentRows ? contentRows[contentRow++] : undefined,
        });
      }
    }
    if (row !== rows.length) throw new Error(`subtree ${level}/${x}/${y}: ${rows.length} rows for ${row} tiles`);
    for (let dx = 0; dx < 2 ** subtreeLevels; ++dx)
      for (let dy = 0; dy < 2 ** subtreeLevels; ++dy)
        if (isAvailable(subtree, json.childSubtreeAvailability, morton(dx, dy)))
          visit(level + subtreeLevels, x * 2 ** subtreeLevels + dx, y * 2 ** subtreeLevels + dy);
  };
  visit(0, 0, 0);
  return tiles;
}

/** A .glb: its JSON, its buffer, and accessors without compression as arrays. */
export function readGlb(path) {
  const bytes = readFileSync(path);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const jsonLength = view.getUint32(12, true);
  const json = JSON.parse(bytes.toString("utf8", 20, 20 + jsonLength));
  const start = 20 + jsonLength + 8;
  const binary = Uint8Array.prototype.slice.call(bytes, start, start + view.getUint32(20 + jsonLength, true)).buffer;
  const bytesOf = (index) => {
    const { byteOffset = 0, byteLength } = json.bufferViews[index];
    return binary.slice(byteOffset, byteOffset + byteLength);
  };
  return { json, binary, bytesOf };
}
