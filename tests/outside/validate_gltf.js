// Khronos' glTF validator over one file: node validate_gltf.js MODEL.glb   (exit 1 on any error or warning)
const fs = require('fs');
const validator = require('gltf-validator');

validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2]))).then((report) => {
  const { numErrors, numWarnings, messages } = report.issues;
  console.log(`${process.argv[2]}: ${numErrors} errors, ${numWarnings} warnings, ` +
    `${report.info.totalTriangleCount} triangles, ${report.info.drawCallCount} meshes`);
  for (const message of messages.filter((m) => m.severity < 2).slice(0, 10)) console.error(message);
  process.exit(numErrors + numWarnings > 0 ? 1 : 0);
}, (error) => { console.error(String(error)); process.exit(1); });
