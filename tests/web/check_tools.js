// 3d-tiles-tools walks the implicit tiles by its own reading of subtrees and metadata: the same tiles as are there, with
// the boxes and errors that their metadata say, and every content is a file.
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { TilesetSourceFs, TilesetSourceResourceResolver, TilesetTraverser } from "3d-tiles-tools";
import { readTiles } from "./tileset_files.js";

const folder = process.argv[2];
const expected = new Map(readTiles(folder).map((tile) => [tile.file, tile]));
const source = new TilesetSourceFs();
await source.open(folder);
const resolver = new TilesetSourceResourceResolver(".", source);
const traverser = new TilesetTraverser(".", resolver, { depthFirst: false, traverseExternalTilesets: true });
const tileset = JSON.parse(readFileSync(join(folder, "tileset.json"), "utf8"));
let faults = 0;
const fault = (text) => {
  ++faults;
  console.error(text);
};
let contents = 0;
await traverser.traverse(tileset, async (traversed) => {
  if (traversed.isImplicitTilesetRoot()) return true;
  const tile = traversed.asFinalTile();
  for (const content of traversed.getFinalContents()) {
    ++contents;
    const own = expected.get(content.uri);
    if (!own) return fault(`${content.uri}: not among the tiles`), true;
    if (!existsSync(join(folder, content.uri))) fault(`${content.uri}: no such file`);
    if (JSON.stringify(tile.boundingVolume.box) !== JSON.stringify(Array.from(own.metadata.boundingBox)))
      fault(`${content.uri}: another box than its metadata say`);
    if (tile.geometricError !== own.metadata.geometricError)
      fault(`${content.uri}: another error than its metadata say`);
  }
  return true;
});
const wanted = [...expected.values()].filter((tile) => tile.hasContent).length;
if (contents !== wanted) fault(`${contents} contents, ${wanted} were expected`);
console.log(`${contents} tiles with content, ${faults} faults`);
await source.close();
if (faults) process.exit(1);
