/** Numbers as people read them: SI prefixes, significant digits, a true minus sign. */

const PREFIXES = [[1e-12, "p"], [1e-9, "n"], [1e-6, "µ"], [1e-3, "m"], [1, ""], [1e3, "k"]];

/**
 * The SI prefix that keeps a value between 1 and 1000.
 * @param {number} size
 * @returns {{factor: number, prefix: string}}
 */
export function prefixOf(size) {
  const found = PREFIXES.findLast(([factor]) => Math.abs(size) >= factor * 0.9999999) ?? PREFIXES[0];
  return size === 0 ? {factor: 1, prefix: ""} : {factor: found[0], prefix: found[1]};
}

/**
 * A value with a unit, such as "12.34567 µm".
 * @param {number} value in the unit without prefix
 * @param {string} unit
 * @param {number} digits significant ones
 */
export function withUnit(value, unit, digits) {
  const {factor, prefix} = prefixOf(value);
  const rounded = (value / factor).toPrecision(digits);
  return `${minus(rounded.includes("e") ? String(Number(rounded)) : rounded)} ${prefix}${unit}`;
}

/**
 * A small number such as 1.2e-7 as "1.2·10⁻⁷".
 * @param {number} value
 * @param {number} digits
 */
export function power(value, digits = 2) {
  if (value === 0) return "0";
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  if (Math.abs(Number(exponent)) < 3) return minus(Number(value.toPrecision(digits)).toString());
  const raised = [...String(Number(exponent))].map(c => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)])).join("");
  return `${minus(mantissa)}·10${raised}`;
}

/** @param {string} text */
export const minus = text => text.replace("-", "\u2212");

/**
 * Round steps 1, 2, 5, 10 ... below a value.
 * @param {number} value
 */
export function roundDown(value) {
  const unit = 10 ** Math.floor(Math.log10(value));
  return unit * ([5, 2, 1].find(step => step * unit <= value * 1.0000001) ?? 1);
}
