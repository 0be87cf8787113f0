// The witness of looks.py: three.js draws a model as the stage says. looks.py calls `window.looks`, and reads pixels.
import * as THREE from 'three';
import {ThreeMFLoader} from 'three/addons/loaders/3MFLoader.js';
import {AMFLoader} from 'three/addons/loaders/AMFLoader.js';
import {ColladaLoader} from 'three/addons/loaders/ColladaLoader.js';
import {FBXLoader} from 'three/addons/loaders/FBXLoader.js';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {LWOLoader} from 'three/addons/loaders/LWOLoader.js';
import {MTLLoader} from 'three/addons/loaders/MTLLoader.js';
import {OBJLoader} from 'three/addons/loaders/OBJLoader.js';
import {PLYLoader} from 'three/addons/loaders/PLYLoader.js';
import {STLLoader} from 'three/addons/loaders/STLLoader.js';
import {TDSLoader} from 'three/addons/loaders/TDSLoader.js';
import {USDLoader} from 'three/addons/loaders/USDLoader.js';
import {VRMLLoader} from 'three/addons/loaders/VRMLLoader.js';

// Tessera's own curve (client/draw/LIGHT.md), so that light is compared and not what becomes of it on a screen:
// Khronos PBR Neutral without its toe.
const NONE = 'vec3 CustomToneMapping( vec3 color ) { return color; }';
const NEUTRAL = `vec3 CustomToneMapping(vec3 color) {
  float start = 0.8, rest = 1.0 - start, peak = max(color.r, max(color.g, color.b));
  if (peak <= start) return color;
  float lower = 1.0 - rest * rest / (peak + rest - start);
  return mix(color * (lower / peak), vec3(lower), 1.0 - 1.0 / (0.15 * (peak - lower) + 1.0));
}`;
if (!THREE.ShaderChunk.tonemapping_pars_fragment.includes(NONE)) throw new Error('three has another CustomToneMapping');
THREE.ShaderChunk.tonemapping_pars_fragment = THREE.ShaderChunk.tonemapping_pars_fragment.replace(NONE, NEUTRAL);

let renderer, surroundings, model;

async function objWithMaterials(url) {
  const loader = new OBJLoader();
  const named = /^mtllib\s+(.+)$/m.exec(await (await fetch(url)).text());
  const folder = url.slice(0, url.lastIndexOf('/') + 1);
  if (named) {
    try {
      const materials = await new MTLLoader().setPath(folder).loadAsync(named[1].trim());
      materials.preload();
      loader.setMaterials(materials);
    } catch {
      // It is shown without.
    }
  }
  return loader.loadAsync(url);
}

/** Of a reader of bare geometry: points where it has no faces. */
function shown(geometry) {
  if (!geometry.attributes.normal && geometry.index) geometry.computeVertexNormals();
  const coloured = {vertexColors: geometry.attributes.color !== undefined};
  if (geometry.isPoints || (!geometry.index && geometry.attributes.position.count % 3 !== 0))
    return new THREE.Points(geometry, new THREE.PointsMaterial(coloured));
  return new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({...coloured, roughness: 1, side: THREE.DoubleSide}));
}

/** What reads a file that ends so: the scene of it. */
const readers = {
  glb: async (url) => (await new GLTFLoader().loadAsync(url)).scene,
  gltf: async (url) => (await new GLTFLoader().loadAsync(url)).scene,
  obj: objWithMaterials,
  ply: async (url) => shown(await new PLYLoader().loadAsync(url)),
  stl: async (url) => shown(await new STLLoader().loadAsync(url)),
  wrl: (url) => new VRMLLoader().loadAsync(url),
  dae: async (url) => (await new ColladaLoader().loadAsync(url)).scene,
  fbx: (url) => new FBXLoader().loadAsync(url),
  '3ds': async (url) => {
    const found = await new TDSLoader().setResourcePath(url.slice(0, url.lastIndexOf('/') + 1)).loadAsync(url);
    found.rotation.x = -Math.PI / 2;  // up is +Z there, and three.js leaves it so
    return found;
  },
  '3mf': (url) => new ThreeMFLoader().loadAsync(url),
  amf: (url) => new AMFLoader().loadAsync(url),
  lwo: async (url) => {
    const group = new THREE.Group();
    group.add(...(await new LWOLoader().loadAsync(url)).meshes);
    return group;
  },
  ...Object.fromEntries(['usda', 'usdc', 'usdz'].map((ending) => [ending, (url) => new USDLoader().loadAsync(url)])),
};

function turned(node, {position, rotation}) {
  node.position.fromArray(position);
  node.quaternion.fromArray(rotation);
}

window.looks = {
  revision: THREE.REVISION,

  /** size: of the picture, in pixels; url: of the surroundings, width × height × RGBA (float32), lowest row first. */
  async start(size, url, width, height) {
    const canvas = document.createElement('canvas');
    document.body.append(canvas);
    renderer = new THREE.WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: true});
    renderer.setPixelRatio(1);
    renderer.setSize(size, size, false);
    renderer.toneMapping = THREE.CustomToneMapping;
    renderer.shadowMap.enabled = true;
    const pixels = new Float32Array(await (await fetch(url)).arrayBuffer());
    const picture = new THREE.DataTexture(pixels, width, height, THREE.RGBAFormat, THREE.FloatType);
    picture.mapping = THREE.EquirectangularReflectionMapping;
    picture.colorSpace = THREE.LinearSRGBColorSpace;
    picture.minFilter = picture.magFilter = THREE.LinearFilter;
    picture.wrapS = THREE.RepeatWrapping;
    picture.needsUpdate = true;
    surroundings = new THREE.PMREMGenerator(renderer).fromEquirectangular(picture).texture;
    const gl = renderer.getContext();
    return {samples: gl.getParameter(gl.SAMPLES), renderer: gl.getParameter(
      gl.getExtension('WEBGL_debug_renderer_info').UNMASKED_RENDERER_WEBGL)};
  },

  /** The box around what the file shows: least and greatest x, y, z; whether it brings lights. */
  async load(url) {
    model = await readers[url.slice(url.lastIndexOf('.') + 1).toLowerCase()](url);
    model.updateMatrixWorld(true);
    const box = new THREE.Box3().setFromObject(model, true);
    let lights = 0;
    model.traverse((node) => {
      lights += node.isLight ? 1 : 0;
      // 1 lx falling straight onto white is white there, 1 / pi here.
      if (node.isLight) node.intensity *= Math.PI;
      // KHR_materials_unlit: the colour is what is seen.
      if (node.isMesh && node.material.isMeshBasicMaterial) node.material.toneMapped = false;
    });
    return {least: box.min.toArray(), greatest: box.max.toArray(), lights};
  },

  /** What `load` has loaded, in one plain material, without lights of its own: its shape alone counts. */
  plain() {
    const material = new THREE.MeshStandardMaterial({color: 0xffffff, roughness: 1, metalness: 0,
                                                     side: THREE.DoubleSide});
    const lights = [];
    model.traverse((node) => {
      if (node.isPoints || node.isLine) throw new Error('of points and lines each program has its own size');
      if (node.isMesh) {
        if (!node.geometry.attributes.normal) node.geometry.computeVertexNormals();
        node.material = Array.isArray(node.material) ? node.material.map(() => material) : material;
      }
      if (node.isLight) lights.push(node);
    });
    for (const light of lights) light.removeFromParent();
  },

  /** What `load` has loaded, as the stage says: its pixels, RGBA from the lowest row, in base64. */
  draw(stage) {
    const scene = new THREE.Scene();
    scene.environment = surroundings;
    const placed = new THREE.Group();
    placed.scale.setScalar(stage.model.scale);
    placed.position.fromArray(stage.model.position);
    placed.add(model);
    scene.add(placed);
    for (const lamp of stage.lights) {
      const light = lamp.directional ? new THREE.DirectionalLight() : new THREE.PointLight();
      light.intensity = lamp.intensity * Math.PI;
      light.position.fromArray(lamp.directional ?? lamp.position);
      if (lamp.shadows) {
        light.castShadow = true;
        light.shadow.mapSize.set(2048, 2048);
        light.shadow.camera.near = 0.01;
        light.shadow.normalBias = 0.01;
        model.traverse((node) => { node.castShadow = node.receiveShadow = true; });
      }
      scene.add(light);
    }
    const camera = new THREE.PerspectiveCamera(stage.camera.fov, 1, 0.1, 100);
    turned(camera, stage.camera);
    renderer.setClearColor(new THREE.Color().setRGB(...stage.background, THREE.LinearSRGBColorSpace), 1);
    renderer.render(scene, camera);
    const gl = renderer.getContext(), side = renderer.domElement.width;
    const pixels = new Uint8Array(4 * side * side);
    gl.readPixels(0, 0, side, side, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let text = '';
    for (let at = 0; at < pixels.length; at += 8192)
      text += String.fromCharCode.apply(null, pixels.subarray(at, at + 8192));
    placed.remove(model);
    return btoa(text);
  },
};
document.title = 'ready';
