/** The pad as a net of vertices: who lies beside whom. */

export class Pad {
  /**
   * @param {ArrayLike<number>} padVertex
   * @param {ArrayLike<number>} triangles
   */
  constructor(padVertex, triangles) {
    this.beside = new Map([...padVertex].map(vertex => [vertex, new Set()]));
    for (let t = 0; t < triangles.length; t += 3) {
      for (let k = 0; k < 3; k++) {
        const a = triangles[t + k], b = triangles[t + (k + 1) % 3];
        this.beside.get(a)?.add(b);
        this.beside.get(b)?.add(a);
      }
    }
    for (const [vertex, others] of this.beside) {
      this.beside.set(vertex, [...others].filter(one => this.beside.has(one)));
    }
  }

  /**
   * The neighbour that lies most nearly in a direction of the picture.
   * @param {number} vertex
   * @param {[number, number]} direction [px], y downwards
   * @param {(vertex: number) => [number, number]} onScreen
   * @returns {?number} null at the pad's edge
   */
  towards(vertex, direction, onScreen) {
    const [x, y] = onScreen(vertex);
    let best = null, most = 0.5;
    for (const other of this.beside.get(vertex)) {
      const [a, b] = onScreen(other), length = Math.hypot(a - x, b - y) || 1;
      const along = ((a - x) * direction[0] + (b - y) * direction[1]) / length;
      if (along > most) [best, most] = [other, along];
    }
    return best;
  }
}
