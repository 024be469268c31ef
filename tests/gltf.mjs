// Validates the GLB of `unic animate` with Khronos' validator, and opens it in three.js.
//
// Contract: no error and no warning; in three.js the garment stands at each frame where the point cache of
// the same run has it, within 0.02 mm. three.js knows four influences a vertex: the body's error is printed,
// and bounded where the character's vertices have no more.
//
//     npm install --prefix target/node gltf-validator three
//     node tests/gltf.mjs target/release/unic MODEL.unic MOTION.npz    at most 300 frames of motion

import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const LARGEST_MM = 0.02;
const [unic, model, motion] = process.argv.slice(2);
const modules = path.resolve(process.env.CARGO_TARGET_DIR ?? 'target', 'node/node_modules');
const load = (file) => import(pathToFileURL(path.join(modules, file)));

async function packages() {
  try {
    return {
      validator: await load('gltf-validator/index.js'),
      three: await load('three/build/three.module.js'),
      loader: await load('three/examples/jsm/loaders/GLTFLoader.js'),
    };
  } catch {
    console.log('skipped: no gltf-validator and three (npm install --prefix target/node gltf-validator three)');
    process.exit(0);
  }
}

/** Positions of a point cache, and its numbers of points and frames. */
function readPc2(file) {
  const bytes = fs.readFileSync(file);
  const positions = new Float32Array(bytes.buffer.slice(bytes.byteOffset + 32, bytes.byteOffset + bytes.length));
  return { positions, points: bytes.readInt32LE(16), frames: bytes.readInt32LE(28) };
}

/** Largest and mean distance of a mesh as three.js deforms it from a frame of the cache, mm. */
function errors(three, mesh, cache, frame) {
  const [found, expected] = [new three.Vector3(), new three.Vector3()];
  let [largest, sum] = [0, 0];
  for (let i = 0; i < cache.points; i++) {
    mesh.localToWorld(mesh.getVertexPosition(i, found));
    const distance = 1e3 * found.distanceTo(expected.fromArray(cache.positions, 3 * (frame * cache.points + i)));
    largest = Math.max(largest, distance);
    sum += distance;
  }
  return { largest, mean: sum / cache.points };
}

async function opensInThree({ three, loader }, bytes, caches, fps) {
  const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const gltf = await new loader.GLTFLoader().parseAsync(data, '');
  const mixer = new three.AnimationMixer(gltf.scene);
  const action = mixer.clipAction(gltf.animations[0]);
  action.setLoop(three.LoopOnce);
  action.clampWhenFinished = true;
  action.play();
  const frames = caches.garment.frames;
  let good = true;
  for (const frame of [0, 1, frames >> 1, frames - 1]) {
    mixer.setTime(frame / fps);
    gltf.scene.updateMatrixWorld(true);
    for (const name of ['garment', 'body']) {
      const mesh = gltf.scene.getObjectByName(name);
      mesh.skeleton?.update();
      const { largest, mean } = errors(three, mesh, caches[name], frame);
      const bounded = name === 'garment' || !mesh.geometry.attributes.joints_1;
      const failed = bounded && !(largest < LARGEST_MM);
      good &&= !failed;
      console.log(`three.js ${three.REVISION}, frame ${frame}, ${name}: largest ${largest.toFixed(4)} mm, ` +
        `mean ${mean.toFixed(4)} mm${failed ? '  FAILED' : ''}`);
    }
  }
  return good;
}

async function validates({ validator }, bytes) {
  const { issues } = await validator.default.validateBytes(new Uint8Array(bytes));
  const { numErrors, numWarnings, numInfos, numHints, messages } = issues;
  console.log(`Khronos' validator ${validator.default.version()}: ${numErrors} errors, ${numWarnings} warnings, ` +
    `${numInfos} notes, ${numHints} hints`);
  messages.slice(0, 10).forEach((m) => console.log(`  ${m.pointer}: ${m.message}`));
  return numErrors + numWarnings === 0;
}

const found = await packages();
if (motion === undefined) {
  console.error('usage: node tests/gltf.mjs UNIC MODEL.unic MOTION.npz');
  process.exit(2);
}
globalThis.self = globalThis; // three's loader expects a browser's global scope
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'gltf-'));
try {
  const animate = (out) => JSON.parse(execFileSync(unic,
    ['animate', model, '--motion', motion, '--out', path.join(folder, out), '--overwrite', '--json'],
    { encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit'] }));
  const { fps } = animate('d.glb');
  animate('d.pc2');
  const bytes = fs.readFileSync(path.join(folder, 'd.glb'));
  const caches = { garment: readPc2(path.join(folder, 'd.pc2')), body: readPc2(path.join(folder, 'd.body.pc2')) };
  const good = [await validates(found, bytes), await opensInThree(found, bytes, caches, fps)];
  process.exitCode = good.every(Boolean) ? 0 : 1;
} finally {
  fs.rmSync(folder, { recursive: true });
}
