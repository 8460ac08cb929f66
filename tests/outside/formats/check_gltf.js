// Khronos' glTF validator over one file: exit code 1 on any error or warning.
//   node check_gltf.js MODEL.glb        with gltf-validator on NODE_PATH
const fs = require('fs');
const validator = require('gltf-validator');

const [, , file] = process.argv;
validator.validateBytes(new Uint8Array(fs.readFileSync(file))).then((report) => {
  const { numErrors, numWarnings, messages } = report.issues;
  const { totalTriangleCount, drawCallCount } = report.info;
  const content = `${totalTriangleCount} triangles, ${drawCallCount} meshes`;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${content}`);
  for (const message of messages.filter((m) => m.severity < 2).slice(0, 10)) console.error(message);
  process.exit(numErrors + numWarnings > 0 ? 1 : 0);
}, (error) => { console.error(String(error)); process.exit(1); });
