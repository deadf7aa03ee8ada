/** Messages of the server, and the model inside an exported page: a JSON header, then plain arrays. */

const TYPES = {f4: Float32Array, f8: Float64Array, u4: Uint32Array, u1: Uint8Array, i2: Int16Array};

/**
 * Header and arrays of a message; the arrays look at the message's own bytes.
 * @param {ArrayBuffer} buffer
 * @returns {{header: object, arrays: Object<string, {data: ArrayLike<number>, shape: number[]}>}}
 */
export function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  for (const {name, type, shape, offset} of header.arrays ?? []) {
    const count = shape.reduce((product, n) => product * n, 1);
    arrays[name] = {data: new TYPES[type](buffer, 4 + length + offset, count), shape};
  }
  return {header, arrays};
}
