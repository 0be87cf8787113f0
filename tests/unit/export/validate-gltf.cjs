// node validate-gltf.cjs FILE…: what the Khronos validator (npm: gltf-validator) says of each; exit 1 where it finds an
// error, 77 where it is not installed. TESSERA_NODE_MODULES: the folder that has it.
const fs = require('fs');
const path = require('path');

const folders = [process.env.TESSERA_NODE_MODULES, '/usr/share/nodejs', '/usr/lib/node_modules',
  '/usr/local/lib/node_modules'].filter(Boolean);
let validator;
try {
  validator = require(require.resolve('gltf-validator', { paths: folders.map((f) => path.dirname(path.resolve(f))) }));
} catch (e) {
  try {
    validator = require(require.resolve('gltf-validator', { paths: folders }));
  } catch (again) {
    console.log('gltf-validator is not installed');
    process.exit(77);
  }
}

(async () => {
  let bad = 0;
  for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
      uri: path.basename(file),
      maxIssues: 0,
      externalResourceFunction: async (uri) =>
        new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri)))),
    });
    const { issues } = report;
    if (issues.numErrors > 0) bad += 1;
    console.log(`${file}: ${issues.numErrors} errors, ${issues.numWarnings} warnings`);
    const shown = issues.messages.filter((m) => m.severity === 0 || process.env.VALIDATOR_WARNINGS && m.severity === 1);
    for (const m of shown.slice(0, 10)) console.log(`  ${m.code} ${m.pointer}: ${m.message}`);
  }
  process.exit(bad > 0 ? 1 : 0);
})();
