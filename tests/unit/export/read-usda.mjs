// node read-usda.mjs FILE…: whether TinyUSDZ (npm: tinyusdz) reads each, and how many meshes it finds; exit 1 where it
// reads one not, 77 where it is not installed. TESSERA_NODE_MODULES: the folder that has it.
import fs from 'fs';
import path from 'path';
import { pathToFileURL } from 'url';

const folder = [process.env.TESSERA_NODE_MODULES, '/usr/local/lib/node_modules', '/usr/lib/node_modules']
  .filter(Boolean).map((f) => path.join(f, 'tinyusdz')).find((f) => fs.existsSync(path.join(f, 'tinyusdz.wasm')));
if (!folder) {
  console.log('tinyusdz is not installed');
  process.exit(77);
}
const node = globalThis.process;
const files = node.argv.slice(2).map((name) => ({ name, bytes: new Uint8Array(fs.readFileSync(name)) }));
const wasm = fs.readFileSync(path.join(folder, 'tinyusdz.wasm'));
// It was built for browsers alone, and looks whether this is one.
globalThis.window = globalThis;
globalThis.document = { currentScript: null };
Object.defineProperty(globalThis, 'process', { value: undefined, configurable: true, writable: true });
const start = (await import(pathToFileURL(path.join(folder, 'tinyusdz.js')))).default;
const usd = await start({
  instantiateWasm: (imports, done) => {
    WebAssembly.instantiate(wasm, imports).then((made) => done(made.instance, made.module));
    return {};
  },
});
let bad = 0;
for (const { name, bytes } of files) {
  const loader = new usd.TinyUSDZLoaderNative();
  const read = loader.loadFromBinary(bytes, name);
  if (!read) bad += 1;
  console.log(`${name}: ${read ? `${loader.numMeshes()} meshes` : loader.error?.() ?? 'unreadable'}`);
}
globalThis.process = node;
node.exit(bad > 0 ? 1 : 0);
