/** Colour maps that colour-blind people can read, and what each quantity is drawn with. */

/** 33 colours each, as hexadecimal digits: cividis, coolwarm (Moreland) and twilight, from matplotlib's tables. */
const MAPS = {
  cividis: [
    "00224e00285b002e6a0533711a386f273e6e32436d3b496c434e6c4b546c535a6d5a5f6e61656f686a716f70737676767d7c78",
    "8482798c8878938e789b9476a39a74aba072b4a76fbcae6cc4b468cdbb63d5c25edec958e7d150f0d846f9e03afee838",
  ].join(""),
  coolwarm: [
    "3b4cc0445acc4e68d85875e16282ea6c8ff1779af782a6fb8db0fe98b9ffa3c2feaec9fcb9d0f9c3d5f4ccd9edd5dbe5dddcdc",
    "e5d8d1ecd3c5f1ccb8f5c4acf7ba9ff7b093f6a586f4987af08b6eeb7d62e46e56dd5f4bd44e41ca3b37be242eb40426",
  ].join(""),
  twilight: [
    "e2d9e2d7d7ddc4ced4acc2cc95b5c781a6c37297c16887be6276ba5f64b55e51ad5d3da1592a8f511b7745135c3811452f1436",
    "3a113a4a13425f174a741e4f872750983550a64550b25652bb6958c27c63c89073cca389d1b6a3d8c7bedfd4d6e2d9e2",
  ].join(""),
};

/** What can be shown: words, colour map, whether it is a length, whether it swings through the cycle. */
export const QUANTITIES = {
  magnitude: {title: "Displacement magnitude", map: "cividis", unit: "m"},
  x: {title: "Displacement along the finger (x)", map: "coolwarm", unit: "m", component: 0},
  y: {title: "Displacement across the finger (y)", map: "coolwarm", unit: "m", component: 1},
  z: {title: "Displacement towards the nail (z)", map: "coolwarm", unit: "m", component: 2},
  normal: {title: "Displacement into the skin", map: "coolwarm", unit: "m", component: 3},
  phase: {title: "Phase of the displacement into the skin", map: "twilight", unit: "deg"},
  strain: {title: "Strain at receptor depth", map: "cividis", unit: ""},
};

/** Grey of what has no value. */
export const NO_VALUE = [168, 168, 168];

/**
 * Colour at a place of a map.
 * @param {string} name
 * @param {number} t from 0 to 1
 * @returns {number[]} red, green, blue, 0 to 255
 */
export function colourAt(name, t) {
  const hex = MAPS[name], last = hex.length / 6 - 1;
  const place = Math.min(Math.max(t, 0), 1) * last, i = Math.min(Math.floor(place), last - 1), part = place - i;
  const channel = (k, c) => parseInt(hex.slice(6 * k + 2 * c, 6 * k + 2 * c + 2), 16);
  return [0, 1, 2].map(c => Math.round((1 - part) * channel(i, c) + part * channel(i + 1, c)));
}

/**
 * A map as CSS.
 * @param {string} name
 * @param {string} direction such as "to right"
 */
export function gradient(name, direction) {
  const stops = Array.from({length: 17}, (_, i) => `rgb(${colourAt(name, i / 16).join(" ")})`);
  return `linear-gradient(${direction}, ${stops.join(", ")})`;
}
