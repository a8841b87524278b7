// A server on this machine only, for the checks that want addresses: serveFolders({ "/tiles/": folder, ... }).
import { createReadStream, statSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";

const types = {
  ".css": "text/css",
  ".html": "text/html",
  ".js": "text/javascript",
  ".json": "application/json",
  ".mjs": "text/javascript",
  ".glb": "model/gltf-binary",
  ".wasm": "application/wasm",
};

/** @returns {Promise<{address: string, close: () => void, missed: string[]}>} addresses that were not found too */
export function serveFolders(folders) {
  const missed = [];
  const server = createServer((request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://host").pathname);
    const mount = Object.keys(folders).find((prefix) => path.startsWith(prefix));
    const file = mount && join(folders[mount], normalize("/" + path.slice(mount.length)));
    const found = file && statSync(file, { throwIfNoEntry: false });
    if (!found?.isFile()) {
      missed.push(path);
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, {
      "Content-Type": types[extname(file)] ?? "application/octet-stream",
      "Content-Length": found.size,
    });
    createReadStream(file).pipe(response);
  });
  return new Promise((resolve) =>
    server.listen(0, "127.0.0.1", () =>
      resolve({ address: `http://127.0.0.1:${server.address().port}`, close: () => server.close(), missed }),
    ),
  );
}
