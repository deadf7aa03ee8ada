/** A surface that is displaced and coloured: the skin, or a section through the tissues. */

import * as THREE from "three";
import {rangeOf, swings, textureOf, writeCoordinates} from "./shading.js";

export class Body {
  /**
   * @param {Float32Array} vertices (n, 3) [mm]
   * @param {Uint32Array} triangles (m, 3)
   * @param {?Float32Array} normal (n, 3) outward, for components into the skin
   * @param {boolean} lit whether light shows its shape; a section is flat
   */
  constructor(vertices, triangles, normal, lit = true) {
    this.lit = lit;
    this.base = vertices;
    this.normal = normal;
    this.u = new Float32Array(2 * vertices.length);
    this.strain = null;
    this.geometry = new THREE.BufferGeometry();
    this.position = new THREE.BufferAttribute(Float32Array.from(vertices), 3);
    this.uv = new THREE.BufferAttribute(new Float32Array(vertices.length / 3 * 2), 2);
    this.geometry.setAttribute("position", this.position);
    this.geometry.setAttribute("uv", this.uv);
    this.geometry.setAttribute("base", new THREE.BufferAttribute(vertices, 3));
    this.geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    this.geometry.computeVertexNormals();
    this.geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(), 1e4); // it moves: never culled
    this.cut = {value: new THREE.Vector4(0, 0, 0, 1)};
    this.material = new (lit ? THREE.MeshLambertMaterial : THREE.MeshBasicMaterial)({
      side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1});
    this.material.onBeforeCompile = shader => hideBeyond(shader, this.cut);
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.group = new THREE.Group();
    this.group.add(this.mesh);
  }

  /**
   * Lines along edges of the surface; they move with it.
   * @param {number[]} pairs vertices, two a line
   * @param {THREE.Material} material
   */
  addLines(pairs, material) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", this.position);
    geometry.setAttribute("base", this.geometry.getAttribute("base"));
    geometry.setIndex(pairs);
    geometry.boundingSphere = this.geometry.boundingSphere;
    material.onBeforeCompile = shader => hideBeyond(shader, this.cut);
    const lines = new THREE.LineSegments(geometry, material);
    this.group.add(lines);
    return lines;
  }

  /** Take a field. @param {Float32Array} u (n, 3, 2) [m] @param {?Float32Array} strain (n) */
  setField(u, strain = null) {
    this.u = u;
    this.strain = strain;
  }

  /** The colour bar's range for a quantity; see `rangeOf`. */
  range(quantity) {
    return rangeOf(quantity, this.u, this.normal, this.strain);
  }

  /** Colour by a quantity. */
  paint(quantity, range, theta) {
    const texture = textureOf(quantity);
    if (this.material.map !== texture) {
      this.material.map = texture;
      this.material.needsUpdate = true;
    }
    writeCoordinates(this.uv.array, quantity, this.u, this.normal, this.strain, range, theta);
    this.uv.needsUpdate = true;
    this.painted = {quantity, range};
  }

  /** Displace to a phase of the cycle. @param {number} scale exaggeration @param {number} theta */
  pose(scale, theta) {
    const c = 1000 * scale * Math.cos(theta), s = 1000 * scale * Math.sin(theta); // metres to millimetres
    const {array} = this.position, {base, u} = this;
    for (let i = 0; i < base.length; i++) array[i] = base[i] + c * u[2 * i] - s * u[2 * i + 1];
    this.position.needsUpdate = true;
    if (this.lit) this.geometry.computeVertexNormals();
    if (this.painted && swings(this.painted.quantity)) this.paint(this.painted.quantity, this.painted.range, theta);
  }

  /** Where a vertex is drawn. @returns {THREE.Vector3} */
  place(vertex) {
    return new THREE.Vector3().fromBufferAttribute(this.position, vertex);
  }

  /** Leave out what lies beyond a plane of the undeformed body. @param {?[string, number]} cut */
  hide(cut) {
    const axis = cut ? "xyz".indexOf(cut[0]) : -1;
    this.cut.value.set(axis === 0 ? 1 : 0, axis === 1 ? 1 : 0, axis === 2 ? 1 : 0, cut ? cut[1] : 1);
  }

  /** Whether a vertex is left out. */
  hides(vertex) {
    const {x, y, z, w} = this.cut.value, [a, b, c] = this.base.subarray(3 * vertex, 3 * vertex + 3);
    return a * x + b * y + c * z > w + 1e-4;
  }

  dispose() {
    this.group.traverse(one => { one.geometry?.dispose(); one.material?.dispose(); });
  }
}

/** Discard in the shader by the undeformed place, so that the cut's edge moves with the tissue. */
function hideBeyond(shader, cut) {
  shader.uniforms.cutPlane = cut;
  shader.vertexShader = `attribute vec3 base;\nuniform vec4 cutPlane;\nvarying float beyond;\n${shader.vertexShader}`
    .replace("#include <begin_vertex>", "#include <begin_vertex>\n beyond = dot(base, cutPlane.xyz) - cutPlane.w;");
  shader.fragmentShader = `varying float beyond;\n${shader.fragmentShader}`
    .replace("void main() {", "void main() {\n if (beyond > 1e-4) discard;");
}

/**
 * Edges between triangles of different marks, and edges of one triangle alone.
 * @param {Uint32Array} triangles (m, 3)
 * @param {(triangle: number) => number} mark of a triangle; negative ones take no part
 * @returns {{between: number[], outer: number[]}} pairs of vertices
 */
export function outlines(triangles, mark) {
  const seen = new Map(), between = [];
  for (let t = 0; t < triangles.length / 3; t++) {
    if (mark(t) < 0) continue;
    for (let k = 0; k < 3; k++) {
      const a = triangles[3 * t + k], b = triangles[3 * t + (k + 1) % 3];
      const key = a < b ? a * 16777216 + b : b * 16777216 + a;
      if (!seen.has(key)) seen.set(key, [mark(t), a, b]);
      else {
        if (seen.get(key)[0] !== mark(t)) between.push(a, b);
        seen.set(key, null);
      }
    }
  }
  return {between, outer: [...seen.values()].flatMap(edge => (edge ? [edge[1], edge[2]] : []))};
}
