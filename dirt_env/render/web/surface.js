// What is drawn of the ground at one moment, per cell: height, slopes, light left in hollows, soil above the target.

const SUN = unit([-0.62, 0.4, 0.66]);

class Surface {
  constructor(episode) {
    const cells = episode.rows * episode.cols;
    this.episode = episode;
    this.height = new Float32Array(cells);
    this.shape = new Float32Array(4 * cells); // slope east, slope north, light, soil
    this.sums = new Float64Array((episode.rows + 1) * (episode.cols + 1));
    this.at = null;
  }

  // Blend moment `first` into the one after it by `share`.
  update(first, share) {
    const moment = first + share;
    if (this.at === moment) return false;
    const { unit: metre, frames } = this.episode;
    const now = this.episode.millimetres(first);
    for (let k = 0; k < now.length; k++) this.height[k] = now[k] * metre;
    if (share > 0 && first + 1 < frames) {
      const next = this.episode.millimetres(first + 1);
      for (let k = 0; k < next.length; k++) this.height[k] += share * (next[k] * metre - this.height[k]);
    }
    this.describe();
    this.at = moment;
    return true;
  }

  describe() {
    const { rows, cols, cell, target } = this.episode, { height, shape } = this;
    this.accumulate();
    const near = Math.max(1, Math.round(0.75 / cell)), wide = Math.max(2, Math.round(2 / cell));
    for (let r = 0; r < rows; r++) {
      const south = Math.max(r - 1, 0), north = Math.min(r + 1, rows - 1);
      for (let c = 0; c < cols; c++) {
        const west = Math.max(c - 1, 0), east = Math.min(c + 1, cols - 1), k = r * cols + c;
        shape[4 * k] = (height[r * cols + east] - height[r * cols + west]) / ((east - west) * cell);
        shape[4 * k + 1] = (height[north * cols + c] - height[south * cols + c]) / ((north - south) * cell);
        const hollow = 0.5 * (this.mean(r, c, near) - height[k]) + 0.16 * (this.mean(r, c, wide) - height[k]);
        shape[4 * k + 2] = Math.min(1.08, Math.max(0.45, 1 - hollow));
        shape[4 * k + 3] = height[k] - target[k];
      }
    }
  }

  accumulate() {
    const { rows, cols } = this.episode, { sums, height } = this, wide = cols + 1;
    for (let r = 0; r < rows; r++) for (let c = 0, line = 0; c < cols; c++) {
      line += height[r * cols + c];
      sums[(r + 1) * wide + c + 1] = sums[r * wide + c + 1] + line;
    }
  }

  mean(r, c, reach) {
    const { rows, cols } = this.episode, { sums } = this, wide = cols + 1;
    const r0 = Math.max(0, r - reach), r1 = Math.min(rows, r + reach + 1);
    const c0 = Math.max(0, c - reach), c1 = Math.min(cols, c + reach + 1);
    return (sums[r1 * wide + c1] - sums[r0 * wide + c1] - sums[r1 * wide + c0] + sums[r0 * wide + c0]) / ((r1 - r0) * (c1 - c0));
  }
}

// Regions and the obstacles' shadows as smooth pixels [start, goal, design, light], `factor` to a cell.
function regionPixels(episode) {
  const { rows, cols, mask } = episode;
  const factor = Math.max(1, Math.min(4, Math.floor(512 / Math.max(rows, cols))));
  const high = rows * factor, wide = cols * factor, pixels = new Uint8Array(4 * high * wide);
  [1, 2, 4, 0].forEach((bit, channel) => {
    const plane = bit ? enlarged(episode, bit, factor) : obstacleLight(episode, factor);
    const smooth = blurred(blurred(plane, high, wide, factor), high, wide, factor);
    for (let k = 0; k < smooth.length; k++) pixels[4 * k + channel] = Math.round(255 * smooth[k]);
  });
  return { pixels, wide, high, any: (bit) => mask.some((value) => value & bit) };
}

function enlarged({ rows, cols, mask }, bit, factor) {
  const wide = cols * factor, plane = new Float32Array(rows * factor * wide);
  for (let r = 0; r < rows * factor; r++) for (let c = 0; c < wide; c++) {
    plane[r * wide + c] = mask[Math.floor(r / factor) * cols + Math.floor(c / factor)] & bit ? 1 : 0;
  }
  return plane;
}

// 1 in the light, 0 where an obstacle 1.4 m high stands between the ground and the sun.
function obstacleLight(episode, factor) {
  const { rows, cols, cell, mask } = episode, wide = cols * factor;
  const plane = new Float32Array(rows * factor * wide).fill(1);
  if (!mask.some((value) => value & 8)) return plane;
  const reach = 1.4 * Math.hypot(SUN[0], SUN[1]) / SUN[2] / cell, steps = Math.max(2, Math.ceil(2 * reach));
  const east = SUN[0] / Math.hypot(SUN[0], SUN[1]) * reach / steps, north = SUN[1] / Math.hypot(SUN[0], SUN[1]) * reach / steps;
  for (let r = 0; r < rows * factor; r++) for (let c = 0; c < wide; c++) {
    for (let step = 0; step <= steps; step++) {
      const y = Math.floor((r + 0.5) / factor + north * step), x = Math.floor((c + 0.5) / factor + east * step);
      if (y >= 0 && x >= 0 && y < rows && x < cols && mask[y * cols + x] & 8) { plane[r * wide + c] = 0; break; }
    }
  }
  return plane;
}

// Mean over `size` pixels along both axes; ends are held.
function blurred(plane, high, wide, size) {
  const half = Math.max(1, Math.round(0.75 * size)), out = new Float32Array(plane.length), mid = new Float32Array(plane.length);
  const pass = (from, to, count, length, along, across) => {
    for (let line = 0; line < count; line++) for (let k = 0; k < length; k++) {
      let sum = 0;
      for (let d = -half; d <= half; d++) sum += from[line * across + Math.min(length - 1, Math.max(0, k + d)) * along];
      to[line * across + k * along] = sum / (2 * half + 1);
    }
  };
  pass(plane, mid, high, wide, 1, wide);
  pass(mid, out, wide, high, wide, 1);
  return out;
}
