// Packed meshes: base64 to bytes to whole steps of the lattice. The format stands in pack.rs.
// Everything is done in slices, so that the page stays alive meanwhile.

const SLICE = 120000;
const breath = () => new Promise((resolve) => setTimeout(resolve));

/** The bytes of a mesh; its text is taken out of the page. */
async function bytesOf(name) {
  const parts = [];
  let length = 0;
  for (const block of document.querySelectorAll(`script[data-mesh="${name}"]`)) {
    const text = atob(block.textContent);
    const part = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) part[i] = text.charCodeAt(i);
    parts.push(part);
    length += part.length;
    block.remove();
    await breath();
  }
  const bytes = new Uint8Array(length);
  let at = 0;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  return bytes;
}

/** Positions (four 16-bit numbers a vertex, the last one unused) and corners of a packed mesh. */
async function unpack({ vertices, triangles }, bytes, progress) {
  const positions = new Uint16Array(4 * vertices);
  const corners = new Uint32Array(3 * triangles);
  let at = 0;
  const next = () => {
    let byte = bytes[at++];
    let value = byte & 127;
    for (let shift = 7; byte > 127; shift += 7) {
      byte = bytes[at++];
      value += (byte & 127) * 2 ** shift;
    }
    return value;
  };
  const step = () => {
    const value = next();
    return (value >>> 1) ^ -(value & 1);
  };
  let x = 0, y = 0, z = 0;
  for (let v = 0; v < vertices; v++) {
    positions[4 * v] = x += step();
    positions[4 * v + 1] = y += step();
    positions[4 * v + 2] = z += step();
    if (v % SLICE === SLICE - 1) {
      progress(at / bytes.length);
      await breath();
    }
  }
  let seen = 0;
  for (let c = 0; c < corners.length; c++) {
    const ago = next();
    corners[c] = ago === 0 ? seen++ : seen - ago;
    if (c % (3 * SLICE) === 0) {
      progress(at / bytes.length);
      await breath();
    }
  }
  return { positions, corners };
}
