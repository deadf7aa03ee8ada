/** Colours of a surface: values become texture coordinates, so that values, not colours, are interpolated. */

import * as THREE from "three";
import {colourAt, NO_VALUE, QUANTITIES} from "./colours.js";

const WIDTH = 256;
const QUIET = 1e-3; // of the largest, below which a phase says nothing
const IN_RANGE = 0.99; // of the vertices

/** A map as a texture: left to right along the values, the upper half grey for what has none. */
function scaleTexture(name) {
  const data = new Uint8Array(WIDTH * 4 * 4);
  for (let row = 0; row < 4; row++) {
    for (let i = 0; i < WIDTH; i++) {
      data.set([...(row < 2 ? colourAt(name, i / (WIDTH - 1)) : NO_VALUE), 255], 4 * (row * WIDTH + i));
    }
  }
  return asTexture(data, WIDTH, 4);
}

/** Phases as directions in a plane, so that interpolation across half a turn goes the short way. */
function phaseTexture(name) {
  const data = new Uint8Array(WIDTH * WIDTH * 4);
  for (let row = 0; row < WIDTH; row++) {
    for (let i = 0; i < WIDTH; i++) {
      const x = 2 * i / (WIDTH - 1) - 1, y = 2 * row / (WIDTH - 1) - 1;
      const colour = Math.hypot(x, y) < 0.25 ? NO_VALUE : colourAt(name, (Math.atan2(y, x) / Math.PI + 1) / 2);
      data.set([...colour, 255], 4 * (row * WIDTH + i));
    }
  }
  return asTexture(data, WIDTH, WIDTH);
}

function asTexture(data, width, height) {
  const texture = new THREE.DataTexture(data, width, height);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

const textures = new Map();

/** @param {string} quantity @returns {THREE.DataTexture} */
export function textureOf(quantity) {
  const name = QUANTITIES[quantity].map;
  if (!textures.has(name)) textures.set(name, quantity === "phase" ? phaseTexture(name) : scaleTexture(name));
  return textures.get(name);
}

/**
 * The range of the colour bar. Point forces dent the skin sharply, so that it ends where one vertex in a hundred lies
 * beyond; `clipped` says whether some do.
 * @param {string} quantity
 * @param {Float32Array} u (n, 3, 2) displacement [m]
 * @param {?Float32Array} normal (n, 3) outward; none inside the tissues
 * @param {?Float32Array} strain (n)
 * @returns {{range: [number, number], largest: number, clipped: boolean}}
 */
export function rangeOf(quantity, u, normal, strain) {
  if (quantity === "phase") return {range: [-180, 180], largest: 180, clipped: false};
  const sizes = quantity === "strain" ? Float32Array.from(strain ?? []).filter(Number.isFinite)
    : Float32Array.from({length: u.length / 6}, (_, k) => (
      quantity === "magnitude" ? magnitude(u, k) : Math.hypot(...component(quantity, u, normal, k))));
  sizes.sort();
  const largest = sizes.at(-1) ?? 0, high = sizes[Math.floor(IN_RANGE * (sizes.length - 1))] || largest;
  const signed = QUANTITIES[quantity].component !== undefined;
  return {range: [signed ? -high : 0, high], largest, clipped: largest > 1.02 * high};
}

/**
 * Texture coordinates of all vertices at a phase of the cycle.
 * @param {Float32Array} uv (n, 2), written
 * @param {string} quantity
 * @param {Float32Array} u
 * @param {Float32Array} normal
 * @param {?Float32Array} strain
 * @param {[number, number]} range
 * @param {number} theta
 */
export function writeCoordinates(uv, quantity, u, normal, strain, range, theta) {
  const [low, high] = range, width = high - low || 1, c = Math.cos(theta), s = Math.sin(theta);
  const largest = quantity === "phase" ? normal && rangeOf("normal", u, normal).largest : 0;
  for (let k = 0; k < uv.length / 2; k++) {
    let value = NaN;
    if (quantity === "magnitude") value = magnitude(u, k);
    else if (quantity === "strain") value = strain ? strain[k] : NaN;
    else {
      const [re, im] = component(quantity, u, normal, k);
      if (quantity === "phase") {
        const size = Math.hypot(re, im), quiet = !(size > QUIET * largest);
        uv[2 * k] = quiet ? 0.5 : 0.5 + 0.48 * re / size;
        uv[2 * k + 1] = quiet ? 0.5 : 0.5 + 0.48 * im / size;
        continue;
      }
      value = re * c - im * s;
    }
    const known = Number.isFinite(value);
    uv[2 * k] = known ? 0.5 / WIDTH + (1 - 1 / WIDTH) * Math.min(Math.max((value - low) / width, 0), 1) : 0;
    uv[2 * k + 1] = known ? 0.2 : 0.8;
  }
}

/** Whether colours change through the cycle. */
export const swings = quantity => QUANTITIES[quantity].component !== undefined;

function magnitude(u, k) {
  let sum = 0;
  for (let i = 6 * k; i < 6 * k + 6; i++) sum += u[i] * u[i];
  return Math.sqrt(sum);
}

/** Real and imaginary part of a component; into the skin for `normal` and `phase`. */
function component(quantity, u, normal, k) {
  const i = QUANTITIES[quantity].component;
  if (i < 3) return [u[6 * k + 2 * i], u[6 * k + 2 * i + 1]];
  if (!normal) return [NaN, NaN];
  let re = 0, im = 0;
  for (let j = 0; j < 3; j++) {
    re -= normal[3 * k + j] * u[6 * k + 2 * j];
    im -= normal[3 * k + j] * u[6 * k + 2 * j + 1];
  }
  return [re, im];
}
