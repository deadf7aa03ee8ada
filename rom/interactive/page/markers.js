/** What stands on the skin: an arrow with its number at each force, a ring at the probe. */

import * as THREE from "three";

const LENGTH = 5, HEAD = 1.7; // mm
const FORCE = 0xd9480f, PROBE = 0x0b7285;
// made once: the renderer keeps what it has drawn until that is disposed of
const SHAFT = new THREE.CylinderGeometry(0.28, 0.28, LENGTH - HEAD, 16), POINT = new THREE.ConeGeometry(0.75, HEAD, 24);
const RED = new THREE.MeshLambertMaterial({color: FORCE});
const signs = new Map();

export class Markers {
  constructor() {
    this.group = new THREE.Group();
    this.arrows = [];
    this.probe = ring();
    this.group.add(this.probe);
  }

  /**
   * @param {{vertex: number, force: number}[]} forces
   * @param {number} selected position among them
   * @param {?number} probe vertex; null where it stands at the first force
   */
  set(forces, selected, probe) {
    for (const {object} of this.arrows) this.group.remove(object);
    this.arrows = forces.map(({vertex, force}, i) => ({
      vertex, force, object: arrow(i + 1, i === selected, forces.length > 1)}));
    for (const {object} of this.arrows) this.group.add(object);
    this.probeVertex = probe;
    this.probe.visible = probe !== null;
  }

  /** Follow the surface. @param {import("./body.js").Body} body */
  follow(body) {
    const normal = vertex => new THREE.Vector3().fromArray(body.normal, 3 * vertex);
    for (const {vertex, force, object} of this.arrows) {
      const outward = normal(vertex);
      object.position.copy(body.place(vertex));
      // it pushes with its tip on the skin, or pulls with its foot there
      object.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), force > 0 ? outward.clone().negate() : outward);
      object.children[0].position.y = force > 0 ? -LENGTH : 0;
    }
    if (this.probeVertex !== null && this.probeVertex !== undefined) {
      const outward = normal(this.probeVertex);
      this.probe.position.copy(body.place(this.probeVertex)).addScaledVector(outward, 0.15);
      this.probe.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), outward);
    }
  }
}

function arrow(number, chosen, numbered) {
  const object = new THREE.Group(), body = new THREE.Group(), thick = chosen ? 1 : 0.7;
  const shaft = new THREE.Mesh(SHAFT, RED), head = new THREE.Mesh(POINT, RED);
  for (const part of [shaft, head]) part.scale.set(thick, 1, thick);
  shaft.position.y = (LENGTH - HEAD) / 2;
  head.position.y = LENGTH - HEAD / 2;
  body.add(shaft, head);
  if (numbered) {
    const key = `${number} ${chosen}`;
    if (!signs.has(key)) signs.set(key, label(String(number), chosen));
    const sign = signs.get(key);
    sign.position.y = -1.2;
    body.add(sign);
  }
  object.add(body);
  return object;
}

/** A number on a disc that always faces the eye. */
function label(text, chosen) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext("2d");
  pen.beginPath();
  pen.arc(32, 32, 28, 0, 2 * Math.PI);
  pen.fillStyle = chosen ? "#d9480f" : "#ffffff";
  pen.fill();
  pen.lineWidth = 5;
  pen.strokeStyle = chosen ? "#ffffff" : "#d9480f";
  pen.stroke();
  pen.fillStyle = chosen ? "#ffffff" : "#a33207";
  pen.font = "bold 40px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 32, 35);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({map: texture, depthTest: false}));
  sprite.scale.setScalar(chosen ? 2.2 : 1.8);
  return sprite;
}

function ring() {
  const group = new THREE.Group();
  const inner = new THREE.Mesh(new THREE.RingGeometry(0.55, 0.8, 32),
                               new THREE.MeshBasicMaterial({color: PROBE, side: THREE.DoubleSide}));
  const outer = new THREE.Mesh(new THREE.RingGeometry(0.8, 1.0, 32),
                               new THREE.MeshBasicMaterial({color: 0xffffff, side: THREE.DoubleSide}));
  group.add(inner, outer);
  return group;
}
