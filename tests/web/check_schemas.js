// tileset.json and subtrees against the JSON schemas of 3D Tiles 1.1: check_schemas.js TILESET SCHEMAS
// Those of glTF's EXT_mesh_features and EXT_structural_metadata too, where SCHEMAS has them.
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import Ajv2020 from "ajv/dist/2020.js";
import { filesBelow, readGlb, readSubtree, readTileset } from "./tileset_files.js";

const [folder, schemas] = process.argv.slice(2);

/** A validator of one schema of a folder, whose schemas refer to each other by their paths. */
function validatorOf(schemaFolder, name) {
  const ajv = new Ajv2020({ strict: false, allErrors: true, validateFormats: false });
  const base = "http://schemas/";
  for (const file of filesBelow(schemaFolder, ".schema.json")) {
    const schema = JSON.parse(readFileSync(join(schemaFolder, file), "utf8"));
    ajv.addSchema({ ...schema, $id: base + file });
  }
  return ajv.getSchema(base + name) ?? assertFound(`${schemaFolder}/${name}`);
}

function assertFound(schema) {
  throw new Error(`${schema}: is not there`);
}

const tiles = join(schemas, "3dtiles");
if (!existsSync(tiles)) {
  console.log(`left out: ${tiles} is not there, the schemas of 3D Tiles 1.1`);
  process.exit(77); // skipped, for CTest
}

let faults = 0;
function judge(what, check, value) {
  if (check(value)) return;
  ++faults;
  for (const error of check.errors) console.error(`${what}: ${error.instancePath} ${error.message}`);
}

judge("tileset.json", validatorOf(tiles, "tileset.schema.json"), readTileset(folder));
const checkSubtree = validatorOf(tiles, "Subtree/subtree.schema.json");
const subtrees = filesBelow(folder, ".subtree");
for (const file of subtrees) judge(file, checkSubtree, readSubtree(join(folder, file)).json);

// A check that cannot fail would be none.
const broken = readTileset(folder);
delete broken.asset.version;
if (validatorOf(tiles, "tileset.schema.json")(broken)) throw new Error("the schemas accept a tileset without a version");

const extensions = join(schemas, "gltf-ext");
if (existsSync(extensions)) {
  const features = validatorOf(extensions, "mesh.primitive.EXT_mesh_features.schema.json");
  const metadata = validatorOf(extensions, "glTF.EXT_structural_metadata.schema.json");
  for (const file of filesBelow(folder, ".glb")) {
    const { json } = readGlb(join(folder, file));
    for (const primitive of json.meshes[0].primitives)
      if (primitive.extensions?.EXT_mesh_features)
        judge(file, features, primitive.extensions.EXT_mesh_features);
    if (json.extensions?.EXT_structural_metadata) judge(file, metadata, json.extensions.EXT_structural_metadata);
  }
} else {
  console.log(`left out: ${extensions} is not there, the schemas of glTF's extensions`);
}
console.log(`tileset.json and ${subtrees.length} subtrees: ${faults} faults`);
if (faults) process.exit(1);
