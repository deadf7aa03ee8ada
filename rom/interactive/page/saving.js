/** Pictures, files and links to keep. */

import {colourAt, QUANTITIES} from "./colours.js";
import {legendWords} from "./figures.js";

/**
 * The view with its colour bar and a caption, as PNG.
 * @param {HTMLCanvasElement} view drawn just now
 * @param {object} what quantity, range and clipped of the colour bar; caption, lines of text; dark
 * @returns {Promise<Blob>}
 */
export function pictureOf(view, {quantity, range, clipped, caption, dark}) {
  const {width, height} = view, unit = Math.max(width, height) / 900, line = 20 * unit;
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height + (caption.length + 1) * line;
  const pen = canvas.getContext("2d"), ink = dark ? "#e8eaed" : "#1b1f24";
  pen.fillStyle = dark ? "#14171a" : "#ffffff";
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(view, 0, 0);
  const {title, map, unit: measure} = QUANTITIES[quantity];
  const {words, labels} = legendWords(title, measure, range, clipped);
  const left = 20 * unit, top = height - 190 * unit, tall = 150 * unit;
  for (let i = 0; i < tall; i++) {
    pen.fillStyle = `rgb(${colourAt(map, 1 - i / tall).join(" ")})`;
    pen.fillRect(left, top + i, 16 * unit, 1.5);
  }
  pen.fillStyle = ink;
  pen.font = `${13 * unit}px system-ui, sans-serif`;
  pen.fillText(words, left, top - 14 * unit);
  labels.forEach((text, i) => pen.fillText(text, left + 22 * unit, top + 5 * unit + i * tall / 2));
  caption.forEach((text, i) => pen.fillText(text, left, height + (i + 0.9) * line, width - 2 * left));
  return new Promise(resolve => canvas.toBlob(resolve, "image/png"));
}

/** Hand a file to the browser. */
export function save(href, name) {
  const link = document.createElement("a");
  Object.assign(link, {href, download: name});
  link.click();
}

/** Copy text; false where the browser does not allow it. */
export async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
