// Writes twins of glTF files, compressed in each way: node make-twins.mjs FOLDER FILE...
// npm install @gltf-transform/core @gltf-transform/extensions @gltf-transform/functions draco3dgltf meshoptimizer sharp
import fs from 'node:fs';
import path from 'node:path';
import { NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { draco, meshopt, quantize, textureCompress } from '@gltf-transform/functions';
import draco3d from 'draco3dgltf';
import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';
import sharp from 'sharp';

await MeshoptEncoder.ready;
await MeshoptDecoder.ready;
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
  'draco3d.encoder': await draco3d.createEncoderModule(),
  'draco3d.decoder': await draco3d.createDecoderModule(),
  'meshopt.encoder': MeshoptEncoder,
  'meshopt.decoder': MeshoptDecoder,
});
const ways = {
  plain: () => {}, // what the library itself changes of a file: a sheared node loses its shear
  draco: draco({ method: 'edgebreaker' }),
  'draco-seq': draco({ method: 'sequential' }),
  meshopt: meshopt({ encoder: MeshoptEncoder, level: 'medium' }),
  'meshopt-high': meshopt({ encoder: MeshoptEncoder, level: 'high' }),
  quant: quantize(),
  webp: textureCompress({ encoder: sharp, targetFormat: 'webp' }),
};
const [folder, ...files] = process.argv.slice(2);
fs.mkdirSync(folder, { recursive: true });
for (const file of files) {
  for (const [name, way] of Object.entries(ways)) {
    const document = await io.read(file);
    await document.transform(way);
    await io.write(path.join(folder, `${path.parse(file).name}.${name}.glb`), document);
  }
}
