// Khronos' glTF validator on every tile: no error, no warning.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import validator from "gltf-validator";
import { filesBelow } from "./tileset_files.js";

const folder = process.argv[2];
const files = filesBelow(folder, ".glb");
if (files.length === 0) throw new Error(`${folder}: no tile`);
const severe = 1; // 0 error, 1 warning, 2 information, 3 hint
let faults = 0;
let notes = new Map();
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(join(folder, file))), { maxIssues: 1000 });
  for (const message of report.issues.messages) {
    if (message.severity <= severe) {
      ++faults;
      console.error(`${file}: ${message.code} ${message.pointer ?? ""} ${message.message}`);
    } else {
      notes.set(message.code, (notes.get(message.code) ?? 0) + 1);
    }
  }
}
console.log(`${files.length} tiles, ${faults} errors and warnings; notes:`, Object.fromEntries(notes));
if (faults) process.exit(1);
