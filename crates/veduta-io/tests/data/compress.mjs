// Writes the compressed models beside this file, with the encoders of Google (Draco) and of
// meshoptimizer: `npm install draco3dgltf@1.5.7 meshoptimizer@1.3.0 && node compress.mjs`.
//
// All hold the same surface: y = ((3 i i + 5 j j) mod 16) / 16 over the grid x = i / 8, z = j / 8 with
// i, j = 0 … 8, two triangles a cell. All coordinates are binary fractions, so that what must come
// back exactly can be compared exactly.
import { writeFileSync } from 'node:fs';
import { MeshoptEncoder } from 'meshoptimizer';
import draco3d from 'draco3dgltf';

const SIDE = 9;
const COUNT = SIDE * SIDE;
const positions = new Float32Array(COUNT * 3);
const normals = new Float32Array(COUNT * 4);
const colors = new Float32Array(COUNT * 4);
for (let j = 0; j < SIDE; j++) {
  for (let i = 0; i < SIDE; i++) {
    const vertex = j * SIDE + i;
    positions.set([i / 8, ((3 * i * i + 5 * j * j) % 16) / 16, j / 8], 3 * vertex);
    const [x, y, z] = [i - 4, 3, j - 4];
    const length = Math.hypot(x, y, z);
    normals.set([x / length, y / length, z / length, 0], 4 * vertex);
    colors.set([i / 8, j / 8, 0.5, (i + j) / 16], 4 * vertex);
  }
}
const indices = [];
for (let j = 0; j + 1 < SIDE; j++) {
  for (let i = 0; i + 1 < SIDE; i++) {
    const p = j * SIDE + i;
    indices.push(p, p + SIDE, p + 1, p + 1, p + SIDE, p + SIDE + 1);
  }
}
const bytes = (array) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);

function glb(json, bin) {
  const text = Buffer.from(JSON.stringify(json));
  const pad = (length) => (4 - (length % 4)) % 4;
  const jsonChunk = Buffer.concat([text, Buffer.alloc(pad(text.length), 0x20)]);
  const binChunk = Buffer.concat([bin, Buffer.alloc(pad(bin.length))]);
  const word = (number) => { const b = Buffer.alloc(4); b.writeUInt32LE(number); return b; };
  const length = 12 + 8 + jsonChunk.length + 8 + binChunk.length;
  return Buffer.concat([
    Buffer.from('glTF'), word(2), word(length),
    word(jsonChunk.length), Buffer.from('JSON'), jsonChunk,
    word(binChunk.length), Buffer.from('BIN\0'), binChunk,
  ]);
}

/** Views that were compressed one by one, and the accessors that read them. */
class Views {
  constructor(extension) {
    this.extension = extension;
    this.parts = [];
    this.length = 0;
    this.unpacked = 0;
    this.views = [];
    this.accessors = [];
  }

  add(stream, count, stride, mode, filter, accessor) {
    while (this.length % 4) { this.parts.push(Buffer.alloc(1)); this.length++; }
    this.views.push({
      buffer: 1, byteOffset: this.unpacked, byteLength: count * stride,
      ...(mode === 'ATTRIBUTES' ? { byteStride: stride } : {}),
      extensions: { [this.extension]: {
        buffer: 0, byteOffset: this.length, byteLength: stream.length, byteStride: stride,
        count, mode, ...(filter ? { filter } : {}),
      } },
    });
    this.unpacked += (count * stride + 3) & ~3;
    this.parts.push(Buffer.from(stream));
    this.length += stream.length;
    return this.accessors.push({ bufferView: this.views.length - 1, count, ...accessor }) - 1;
  }
}

function meshopt(extension, version) {
  const views = new Views(extension);
  const attribute = (array, count, stride, filter, accessor) => {
    const level = version === 0 ? 2 : 3;
    const stream = MeshoptEncoder.encodeVertexBufferLevel(bytes(array), count, stride, level, version);
    return views.add(stream, count, stride, 'ATTRIBUTES', filter, accessor);
  };
  const float = (type) => ({ componentType: 5126, type });
  const plain = attribute(positions, COUNT, 12, null, float('VEC3'));
  const exponential = attribute(
    MeshoptEncoder.encodeFilterExp(positions, COUNT, 12, 15), COUNT, 12, 'EXPONENTIAL', float('VEC3'));
  const octahedral8 = attribute(
    MeshoptEncoder.encodeFilterOct(normals, COUNT, 4, 8), COUNT, 4, 'OCTAHEDRAL',
    { componentType: 5120, normalized: true, type: 'VEC3' });
  const octahedral16 = attribute(
    MeshoptEncoder.encodeFilterOct(normals, COUNT, 8, 12), COUNT, 8, 'OCTAHEDRAL',
    { componentType: 5122, normalized: true, type: 'VEC3' });
  const color = version === 0
    ? attribute(Uint8Array.from(colors, (part) => Math.round(part * 255)), COUNT, 4, null,
      { componentType: 5121, normalized: true, type: 'VEC4' })
    : attribute(MeshoptEncoder.encodeFilterColor(colors, COUNT, 4, 8), COUNT, 4, 'COLOR',
      { componentType: 5121, normalized: true, type: 'VEC4' });
  const color16 = version === 0
    ? attribute(Uint16Array.from(colors, (part) => Math.round(part * 65535)), COUNT, 8, null,
      { componentType: 5123, normalized: true, type: 'VEC4' })
    : attribute(MeshoptEncoder.encodeFilterColor(colors, COUNT, 8, 12), COUNT, 8, 'COLOR',
      { componentType: 5123, normalized: true, type: 'VEC4' });
  // Instance k is turned by k eighths about y.
  const TURNS = 8;
  const turns = new Float32Array(TURNS * 4);
  const places = new Float32Array(TURNS * 3);
  for (let k = 0; k < TURNS; k++) {
    const half = (k * Math.PI) / TURNS;
    turns.set([0, Math.sin(half), 0, Math.cos(half)], 4 * k);
    places.set([3 * k, 0, 0], 3 * k);
  }
  const rotation = attribute(
    MeshoptEncoder.encodeFilterQuat(turns, TURNS, 8, 16), TURNS, 8, 'QUATERNION',
    { componentType: 5122, normalized: true, type: 'VEC4' });
  const translation = attribute(places, TURNS, 12, null, float('VEC3'));

  const wide = Uint32Array.from(indices);
  const narrow = Uint16Array.from(indices);
  const triangles = (array, stride, componentType) => views.add(
    MeshoptEncoder.encodeIndexBuffer(bytes(array), indices.length, stride),
    indices.length, stride, 'TRIANGLES', null, { componentType, type: 'SCALAR' });
  const sequence = views.add(
    MeshoptEncoder.encodeIndexSequence(bytes(wide), indices.length, 4),
    indices.length, 4, 'INDICES', null, { componentType: 5125, type: 'SCALAR' });
  const triangles4 = triangles(wide, 4, 5125);
  const triangles2 = triangles(narrow, 2, 5123);

  const json = {
    asset: { version: '2.0' },
    extensionsUsed: [extension, 'EXT_mesh_gpu_instancing', 'KHR_mesh_quantization'],
    extensionsRequired: [extension, 'EXT_mesh_gpu_instancing', 'KHR_mesh_quantization'],
    scene: 0,
    scenes: [{ nodes: [0, 1] }],
    nodes: [
      { mesh: 0 },
      { mesh: 1, extensions: { EXT_mesh_gpu_instancing: {
        attributes: { TRANSLATION: translation, ROTATION: rotation } } } },
    ],
    meshes: [
      { primitives: [{ attributes: { POSITION: plain, NORMAL: octahedral8, COLOR_0: color },
        indices: triangles4 }] },
      { primitives: [
        { attributes: { POSITION: exponential, NORMAL: octahedral16, COLOR_0: color16 },
          indices: triangles2 },
        { attributes: { POSITION: plain }, indices: sequence },
      ] },
    ],
    accessors: views.accessors,
    bufferViews: views.views,
    buffers: [
      { byteLength: views.length },
      { byteLength: views.unpacked, extensions: { [extension]: { fallback: true } } },
    ],
  };
  return glb(json, Buffer.concat(views.parts));
}

async function draco(method) {
  const module = await draco3d.createEncoderModule();
  const builder = new module.MeshBuilder();
  const mesh = new module.Mesh();
  builder.AddFacesToMesh(mesh, indices.length / 3, Uint32Array.from(indices));
  const flatNormals = normals.filter((_, index) => index % 4 !== 3);
  const position = builder.AddFloatAttributeToMesh(mesh, module.POSITION, COUNT, 3, positions);
  const normal = builder.AddFloatAttributeToMesh(mesh, module.NORMAL, COUNT, 3, flatNormals);
  const color = builder.AddUInt8Attribute(
    mesh, module.COLOR, COUNT, 4, Uint8Array.from(colors, (part) => Math.round(part * 255)));
  const encoder = new module.Encoder();
  encoder.SetAttributeQuantization(module.POSITION, 14);
  encoder.SetAttributeQuantization(module.NORMAL, 10);
  encoder.SetEncodingMethod(module[method]);
  encoder.SetSpeedOptions(method === 'MESH_EDGEBREAKER_ENCODING' ? 3 : 5, 5);
  const out = new module.DracoInt8Array();
  const length = encoder.EncodeMeshToDracoBuffer(mesh, out);
  const stream = Buffer.from(Array.from({ length }, (_, index) => out.GetValue(index) & 255));
  const json = {
    asset: { version: '2.0' },
    extensionsUsed: ['KHR_draco_mesh_compression'],
    extensionsRequired: ['KHR_draco_mesh_compression'],
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{
      attributes: { POSITION: 0, NORMAL: 1, COLOR_0: 2 },
      indices: 3,
      extensions: { KHR_draco_mesh_compression: {
        bufferView: 0, attributes: { POSITION: position, NORMAL: normal, COLOR_0: color },
      } },
    }] }],
    accessors: [
      { componentType: 5126, type: 'VEC3', count: COUNT, min: [0, 0, 0], max: [1, 1, 1] },
      { componentType: 5126, type: 'VEC3', count: COUNT },
      { componentType: 5121, type: 'VEC4', count: COUNT, normalized: true },
      { componentType: 5123, type: 'SCALAR', count: indices.length },
    ],
    bufferViews: [{ buffer: 0, byteLength: stream.length }],
    buffers: [{ byteLength: stream.length }],
  };
  return glb(json, stream);
}

await MeshoptEncoder.ready;
const write = (name, file) => writeFileSync(new URL(name, import.meta.url), file);
write('meshopt-ext.glb', meshopt('EXT_meshopt_compression', 0));
write('meshopt-khr.glb', meshopt('KHR_meshopt_compression', 1));
write('draco-edgebreaker.glb', await draco('MESH_EDGEBREAKER_ENCODING'));
write('draco-sequential.glb', await draco('MESH_SEQUENTIAL_ENCODING'));
