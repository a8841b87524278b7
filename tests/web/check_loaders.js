// loaders.gl reads the tileset, its subtrees and every tile: as many tiles and triangles as are there.
import { load } from "@loaders.gl/core";
import { Tiles3DLoader } from "@loaders.gl/3d-tiles";
import { join } from "node:path";
import { readGlb, readTiles } from "./tileset_files.js";
import { serveFolders } from "./serve_folders.js";

const folder = process.argv[2];
const expected = readTiles(folder);
const server = await serveFolders({ "/tileset/": folder });
try {
  const tileset = await load(`${server.address}/tileset/tileset.json`, Tiles3DLoader, {
    "3d-tiles": { isTileset: true },
    worker: false,
  });
  const contents = [];
  let tiles = 0;
  const visit = (tile) => {
    ++tiles;
    if (tile.contentUrl) contents.push(tile.contentUrl);
    (tile.children ?? []).forEach(visit);
  };
  visit(tileset.root);
  let triangles = 0;
  let wanted = 0;
  for (const tile of expected.filter((t) => t.hasContent)) {
    const { json } = readGlb(join(folder, tile.file));
    wanted += json.accessors[json.meshes[0].primitives[0].indices].count / 3;
  }
  for (const url of contents) {
    const content = await load(url, Tiles3DLoader, { "3d-tiles": { loadGLTF: true }, worker: false });
    const [primitive] = content.gltf.meshes[0].primitives;
    triangles += (primitive.indices.value ?? primitive.indices).length / 3;
  }
  console.log(`${tiles} tiles, ${contents.length} with content, ${triangles} triangles`);
  if (contents.length !== expected.filter((t) => t.hasContent).length || triangles !== wanted) {
    console.error(`${expected.length} tiles and ${wanted} triangles were expected`);
    process.exitCode = 1;
  }
} finally {
  server.close();
}
