// The paper's cells at one moment as boxes, each as high as the cell is full; those that nothing of can be seen are left out.

const BOX = 7; // numbers of a box: column, row, lower and upper end in metres, red, green, blue

class CellBoxes {
  constructor(episode) {
    const { levels } = episode.voxels;
    this.episode = episode;
    this.fill = new Float32Array(episode.rows * episode.cols * levels);
    this.boxes = new Float32Array(BOX * 1024);
    this.count = 0;
    this.at = null;
  }

  // Blend moment `first` into the one after it by `share`; `heights` m are those of the ground under obstacles.
  update(first, share, heights) {
    const moment = first + share;
    if (this.at === moment) return false;
    const { frames, voxels: { fills, perFill } } = this.episode, { fill } = this;
    const now = fills(first);
    for (let k = 0; k < now.length; k++) fill[k] = now[k] / perFill;
    if (share > 0 && first + 1 < frames) {
      const next = fills(first + 1);
      for (let k = 0; k < next.length; k++) fill[k] += share * (next[k] / perFill - fill[k]);
    }
    this.collect(heights);
    this.at = moment;
    return true;
  }

  collect(heights) {
    const { rows, cols, mask, voxels: { bottom, dy, levels } } = this.episode, { fill } = this, base = baseOf(this.episode);
    const lowest = Math.max(0, Math.floor((base - bottom) / dy));
    this.count = 0;
    for (let r = 0; r < rows; r++) for (let c = 0; c < cols; c++) {
      const column = r * cols + c, first = column * levels;
      if (mask[column] & 8) { this.add(column, Math.min(base, heights[column]), heights[column]); continue; }
      for (let m = lowest; m < levels; m++) {
        const here = fill[first + m];
        if (here > 0 && this.isSeen(r, c, m, here)) this.add(column, Math.max(base, bottom + m * dy), bottom + (m + Math.max(here, 0.004)) * dy);
      }
    }
  }

  // Whether the top, the underside or one of the sides of a cell is open.
  isSeen(r, c, m, here) {
    const { rows, cols, voxels: { levels } } = this.episode, { fill } = this;
    const at = (r * cols + c) * levels + m;
    if (here < 1 || m + 1 === levels || fill[at + 1] === 0 || (m > 0 && fill[at - 1] < 1)) return true;
    if (r === 0 || c === 0 || r + 1 === rows || c + 1 === cols) return true;
    return fill[at - levels] < 1 || fill[at + levels] < 1 || fill[at - cols * levels] < 1 || fill[at + cols * levels] < 1;
  }

  add(column, low, high) {
    const { cols, mask, target } = this.episode, k = BOX * this.count++;
    if (k + BOX > this.boxes.length) {
      const more = new Float32Array(2 * this.boxes.length);
      more.set(this.boxes);
      this.boxes = more;
    }
    const over = high - target[column], paint = groundPaint(mask[column], over / (Math.abs(over) + 0.06));
    this.boxes.set([column % cols, Math.floor(column / cols), low, high, ...paint], k);
  }
}

// Colour of the ground with a `share` of soil (or, below 0, of what is missing), tinted by the regions of a mask.
function groundPaint(mask, share) {
  let paint = mixed([0.66, 0.61, 0.5], share > 0 ? [0.58, 0.35, 0.18] : mask & 4 ? [0.25, 0.4, 0.62] : [0.38, 0.32, 0.27], Math.abs(share));
  if (mask & 4) paint = mixed(paint, [0.8, 0.47, 0.65], 0.25);
  if (mask & 1) paint = mixed(paint, [1, 0.78, 0.22], 0.3);
  if (mask & 2) paint = mixed(paint, [0.12, 0.5, 0.92], 0.38);
  return paint;
}
