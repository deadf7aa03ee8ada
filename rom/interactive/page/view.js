/** The 3D view: skin, section and markers; orbiting, picking, slow motion. */

import * as THREE from "three";
import {OrbitControls} from "three/addons/controls/OrbitControls.js";
import {Body, outlines} from "./body.js";
import {QUANTITIES} from "./colours.js";
import {Markers} from "./markers.js";

const CYCLE_MS = 2000;
const SHOWN_MM = 3; // what the largest displacement is drawn as where the exaggeration is automatic
const CLICK_PX = 6;
const SLOW_FRAME_MS = 29, COARSEST = 0.5;
const LONGEST_PAUSE_MS = 120; // of the motion, while a new field is computed
const UP = new THREE.Vector3(1, 0, 0); // the finger points up, as on a fingerprint

export class View {
  #playing = false;
  #theta = 0;
  #last = null;
  #pending = false;
  #afterPaint = [];
  #drawn = [];
  #painted = new MessageChannel(); // one for all frames: a channel is kept as long as its port listens
  #intervals = [];
  #pixelRatio = 1;
  #expected = null;
  frames = 0;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {object} arrays of `hello`
   * @param {{onPick: Function, onView: Function}} listeners
   */
  constructor(canvas, arrays, listeners) {
    this.canvas = canvas;
    this.listeners = listeners;
    this.#painted.port1.onmessage = () => this.#drawn.splice(0).forEach(call => call());
    const vertices = arrays.vertices.data, normal = arrays.vertex_normal.data;
    this.triangles = Uint32Array.from(arrays.triangles.data);
    this.pad = [...arrays.pad_vertex.data];
    this.isPad = new Set(this.pad);
    this.skin = new Body(vertices, this.triangles, normal);
    const tissue = arrays.vertex_tissue.data, tip = this.triangles;
    const all = [0, 1, 2], padOf = t => (all.every(k => this.isPad.has(tip[3 * t + k])) ? 0 : -1);
    const tissueOf = t => Math.min(...all.map(k => tissue[tip[3 * t + k]]));
    this.padEdge = this.skin.addLines(outlines(tip, padOf).outer, new THREE.LineBasicMaterial({color: 0xffffff}));
    this.skin.addLines(outlines(tip, tissueOf).between, new THREE.LineBasicMaterial({
      color: 0x222222, transparent: true, opacity: 0.45}));
    this.section = null;
    this.markers = new Markers();
    this.scene = new THREE.Scene();
    this.scene.add(this.skin.group, this.markers.group);
    this.#addBone(arrays);
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: !drawnBySoftware(), alpha: true});
    this.renderer.setClearAlpha(0);
    this.camera = new THREE.PerspectiveCamera(30, 1, 1, 1000);
    this.camera.up.copy(UP);
    this.scene.add(this.camera, new THREE.AmbientLight(0xffffff, 1.9));
    const lamp = new THREE.DirectionalLight(0xffffff, 1.5);
    lamp.position.set(-30, 50, 40);
    this.camera.add(lamp);
    const box = new THREE.Box3().setFromArray(vertices);
    this.middle = box.getCenter(new THREE.Vector3());
    this.extent = box.getSize(new THREE.Vector3());
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.enablePan = true;
    this.orbit.minDistance = 15;
    this.orbit.maxDistance = 250;
    this.orbit.addEventListener("change", () => this.draw());
    this.orbit.addEventListener("end", () => listeners.onView());
    this.#listenForClicks();
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
    this.#resize();
    this.home();
  }

  #addBone(arrays) {
    if (!arrays.bone_vertices) return;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(arrays.bone_vertices.data, 3));
    geometry.setIndex(new THREE.BufferAttribute(arrays.bone_triangles.data, 1));
    geometry.computeVertexNormals();
    this.bone = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({color: 0xe9e1cf, side: THREE.DoubleSide}));
    this.bone.visible = false;
    this.scene.add(this.bone);
  }

  // ---- what is shown ----------------------------------------------------------------------------------------

  /** Forces and probe. */
  mark(forces, selected, probe) {
    this.markers.set(forces, selected, probe);
    this.markers.follow(this.skin);
    this.draw();
  }

  /**
   * A field, at the next frame.
   * @param {Float32Array} u at the surface's vertices
   * @param {object} shown quantity, strain, cutU, moving
   * @returns {{range: [number, number], clipped: boolean, scale: number}}
   */
  show(u, {quantity, strain, cutU, moving, scale}) {
    this.skin.setField(u, strain);
    if (this.section && cutU) this.section.setField(cutU);
    this.quantity = quantity;
    this.padEdge.material.color.set(QUANTITIES[quantity].map === "cividis" ? 0xffffff : 0x333333);
    this.moving = moving;
    const {range, clipped} = this.skin.range(quantity);
    Object.assign(this, {range, clipped});
    this.scale = scale ?? this.automaticScale();
    this.#pose(true);
    this.draw();
    return {range, clipped, scale: this.scale};
  }

  /** The exaggeration at which the largest displacement is at most 3 mm: 1, 2 or 5 times a power of ten. */
  automaticScale() {
    const {largest} = this.skin.range("magnitude");
    if (!(largest > 0)) return 1;
    const wanted = SHOWN_MM / 1000 / largest, unit = 10 ** Math.floor(Math.log10(wanted));
    return unit * [5, 2, 1].find(step => step * unit <= wanted * 1.0000001);
  }

  /** Magnify the motion. @param {?number} scale null chooses it automatically */
  setScale(scale) {
    this.scale = scale ?? this.automaticScale();
    this.#pose(false);
    this.draw();
    return this.scale;
  }

  /** A section's geometry, or none. */
  setSection(cut, arrays) {
    if (this.section) {
      this.scene.remove(this.section.group);
      this.section.dispose();
      this.section = null;
    }
    this.skin.hide(cut);
    if (this.bone) this.bone.visible = cut !== null;
    if (cut && arrays) {
      const vertices = arrays.cut_vertices.data, triangles = arrays.cut_triangles.data;
      const tissue = arrays.cut_tissue.data;
      this.section = new Body(vertices, triangles, null, false);
      const lines = outlines(triangles, t => tissue[t]);
      this.section.addLines([...lines.between, ...lines.outer], new THREE.LineBasicMaterial({color: 0xffffff}));
      this.scene.add(this.section.group);
    }
    this.draw();
  }

  /** Run or stop the slow motion. */
  play(on) {
    this.#playing = on;
    this.#last = null;
    this.#intervals = [];
    if (!on) this.#sharpen();
    this.draw();
  }

  /** A new field is being computed, or has come: the motion makes way for it, since both want the same cores. */
  expect(field) {
    this.#expected = field ? performance.now() : null;
  }

  /** Phase of the cycle shown, 0 to 2 pi. */
  get theta() {
    return this.moving ? this.#theta : 0;
  }

  setTheta(theta) {
    this.#theta = theta;
    this.#pose(false);
    this.draw();
  }

  // ---- frames -----------------------------------------------------------------------------------------------

  /** Draw at the next frame; `then` is called once it has been painted. */
  draw(then) {
    if (then) this.#afterPaint.push(then);
    if (this.#pending) return;
    this.#pending = true;
    requestAnimationFrame(time => this.#frame(time));
  }

  #frame(time) {
    this.#pending = false;
    const moves = this.#playing && this.moving;
    if (moves && this.#expected !== null && time - this.#expected < LONGEST_PAUSE_MS) {
      this.#last = null;
      this.draw();
      return;
    }
    if (moves) {
      if (this.#last !== null) {
        this.#theta = (this.#theta + 2 * Math.PI * Math.min(time - this.#last, 200) / CYCLE_MS) % (2 * Math.PI);
        this.#adapt(time - this.#last);
      }
      this.#last = time;
      this.#pose(false);
      this.listeners.onPhase?.(this.#theta);
    }
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
    this.canvas.dataset.frames = this.frames;
    if (this.#afterPaint.length) {
      this.#drawn.push(...this.#afterPaint.splice(0));
      this.#painted.port2.postMessage(null); // arrives after this frame has been painted
    }
    if (moves) this.draw();
  }

  #pose(repaint) {
    if (!this.quantity) return;
    const theta = this.theta;
    for (const body of [this.skin, this.section]) {
      if (!body) continue;
      if (repaint) body.paint(this.quantity, this.range, theta);
      body.pose(this.scale, theta);
    }
    this.markers.follow(this.skin);
  }

  /** Fewer pixels where frames come too slowly: motion matters more than sharpness while it moves. */
  #adapt(interval) {
    this.#intervals.push(interval);
    if (this.#intervals.length < 12) return;
    const middle = this.#intervals.sort((a, b) => a - b)[6];
    this.#intervals = [];
    if (middle > SLOW_FRAME_MS) this.#setPixelRatio(Math.max(COARSEST, 0.8 * this.#pixelRatio));
  }

  #sharpen() {
    this.#setPixelRatio(Math.min(window.devicePixelRatio, 2));
  }

  #setPixelRatio(ratio) {
    this.#pixelRatio = ratio;
    this.renderer.setPixelRatio(ratio);
  }

  #resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.#sharpen();
    this.draw();
  }

  // ---- the camera -------------------------------------------------------------------------------------------

  /** The view of a first visit: on the pad, a little from the side, all of the finger within the picture. */
  home() {
    const half = Math.tan(this.camera.fov * Math.PI / 360), {x, y} = this.extent;
    const distance = 1.28 * Math.max(x / 2 / half, (y / 2 + 3) / half / this.camera.aspect) + this.extent.z / 2;
    this.orbit.target.copy(this.middle);
    this.camera.position.copy(this.middle).addScaledVector(new THREE.Vector3(0.38, 0.5, -1).normalize(), distance);
    this.orbit.update();
    this.draw();
  }

  /** Camera and target as six numbers [mm]. */
  get viewpoint() {
    return [...this.camera.position.toArray(), ...this.orbit.target.toArray()];
  }

  set viewpoint(numbers) {
    this.camera.position.fromArray(numbers);
    this.orbit.target.fromArray(numbers, 3);
    this.orbit.update();
    this.draw();
  }

  /** Turn by angles [rad] about the finger's axis and over its tip. */
  turn(around, over) {
    this.#moveCamera(s => {
      s.theta -= around;
      s.phi = Math.min(Math.max(s.phi - over, 0.05), Math.PI - 0.05);
    });
  }

  zoom(factor) {
    const {minDistance, maxDistance} = this.orbit;
    this.#moveCamera(s => (s.radius = Math.min(Math.max(s.radius * factor, minDistance), maxDistance)));
  }

  #moveCamera(change) {
    const toY = new THREE.Quaternion().setFromUnitVectors(UP, new THREE.Vector3(0, 1, 0));
    const offset = this.camera.position.clone().sub(this.orbit.target).applyQuaternion(toY);
    const spherical = new THREE.Spherical().setFromVector3(offset);
    change(spherical);
    offset.setFromSpherical(spherical).applyQuaternion(toY.invert());
    this.camera.position.copy(this.orbit.target).add(offset);
    this.orbit.update();
    this.listeners.onView();
    this.draw();
  }

  /** Where a vertex stands in the picture [CSS px]. */
  onScreen(vertex) {
    const place = this.skin.place(vertex).project(this.camera), {clientWidth, clientHeight} = this.canvas;
    return [(place.x + 1) / 2 * clientWidth, (1 - place.y) / 2 * clientHeight];
  }

  // ---- picking ----------------------------------------------------------------------------------------------

  #listenForClicks() {
    let down = null;
    this.canvas.addEventListener("pointerdown", event => (down = event.isPrimary ? event : null));
    this.canvas.addEventListener("pointerup", event => {
      const still = down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < CLICK_PX;
      if (still && event.button === 0) this.#pick(event);
      down = null;
    });
  }

  #pick(event) {
    const box = this.canvas.getBoundingClientRect(), ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1,
                                        1 - 2 * (event.clientY - box.top) / box.height), this.camera);
    const hit = ray.intersectObject(this.skin.mesh).find(one => !this.skin.hides(one.face.a));
    if (!hit) return;
    this.listeners.onPick({vertex: this.#nearest(hit.point, null), pad: this.#nearest(hit.point, this.pad), event});
  }

  /** The nearest vertex to a point, or the nearest of some; null where it lies off by more than 2 mm. */
  #nearest(point, among) {
    let best = null, least = among ? 2 : Infinity;
    const count = among ? among.length : this.skin.base.length / 3;
    for (let i = 0; i < count; i++) {
      const vertex = among ? among[i] : i, distance = this.skin.place(vertex).distanceTo(point);
      if (distance < least) [best, least] = [vertex, distance];
    }
    return best;
  }
}

/** Whether there is no graphics card to draw with: smooth edges would cost most of the frames. */
function drawnBySoftware() {
  const pen = document.createElement("canvas").getContext("webgl2");
  const info = pen?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? pen.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  pen?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}
