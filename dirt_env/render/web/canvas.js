// Draws without a graphics card: the same ground and machine as filled polygons, far ones first.

const FLAT_SIDE = 72;

class FlatRenderer {
  constructor(canvas, machine, blade) {
    Object.assign(this, { canvas, machine, blade, name: "canvas" });
    this.context = canvas.getContext("2d");
    this.dozer = dozerFaces(machine);
    this.front = bladeFaces(blade, machine);
  }

  setEpisode(episode) {
    this.episode = episode;
    this.surface = new Surface(episode);
    this.surface.update(0, 0);
    this.stride = Math.max(1, Math.ceil(Math.max(episode.rows, episode.cols) / FLAT_SIDE));
    this.outlines = regionOutlines(episode);
    this.tall = null;
    this.cells = episode.voxels ? new CellBoxes(episode) : null;
  }

  draw(camera, moment) {
    const { canvas, context, episode } = this;
    this.surface.update(moment.first, moment.share);
    if (this.tall !== moment.tall) {
      this.tall = moment.tall;
      this.blocks = obstacleFaces(episode, this.surface.height, moment.tall);
    }
    const view = camera.matrix(canvas.width / canvas.height, moment.tall);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.lineJoin = "round";
    if (moment.cells) this.drawCells(view, moment);
    else {
      this.drawGround(view, moment);
      this.drawOutlines(view, moment);
    }
    this.drawShadow(view, moment);
    this.drawModels(view, moment);
  }

  project(matrix, point) {
    const [x, y, , w] = transform(matrix, point);
    return w > 0.05 ? [(0.5 + 0.5 * x / w) * this.canvas.width, (0.5 - 0.5 * y / w) * this.canvas.height, w] : null;
  }

  drawGround({ matrix, eye }, { tall }) {
    const { rows, cols, cell } = this.episode, { stride } = this;
    const lines = (count, at) => {
      const all = [];
      for (let k = 0; k < count; k += stride) all.push(k);
      const turn = at / cell;
      return all.sort((a, b) => Math.abs(b - turn) - Math.abs(a - turn));
    };
    const order = [lines(rows, eye[1]), lines(cols, eye[0])];
    const point = (r, c) => this.project(matrix, [c * cell, r * cell, this.cornerHeight(r, c) * tall]);
    for (const r of order[0]) for (const c of order[1]) {
      const r1 = Math.min(rows, r + stride), c1 = Math.min(cols, c + stride);
      this.fill([point(r, c), point(r, c1), point(r1, c1), point(r1, c)], this.groundColor(r, c, tall));
    }
  }

  // Boxes from far to near: columns by rows and columns of the grid, in each of them from below.
  drawCells({ matrix, eye }, { first, share, tall }) {
    const { cell } = this.episode, { cells } = this;
    cells.update(first, share, this.surface.height);
    const { boxes } = cells, turn = [eye[0] / cell - 0.5, eye[1] / cell - 0.5];
    const order = Uint32Array.from({ length: cells.count }, (_, k) => k * BOX);
    const far = (k, axis) => Math.abs(boxes[k + axis] - turn[axis]);
    order.sort((a, b) => far(b, 1) - far(a, 1) || far(b, 0) - far(a, 0) || boxes[a + 2] - boxes[b + 2]);
    for (const k of order) {
      const [c, r, low, high, ...paint] = boxes.subarray(k, k + BOX);
      const [x0, x1, y0, y1, z0, z1] = [c * cell, (c + 1) * cell, r * cell, (r + 1) * cell, low * tall, high * tall];
      const edge = css(paint, 0.42);
      const face = (points, light) => this.fill(points.map((p) => this.project(matrix, p)), css(paint, light), edge);
      if (eye[0] < x0) face([[x0, y1, z0], [x0, y0, z0], [x0, y0, z1], [x0, y1, z1]], 0.86);
      if (eye[0] > x1) face([[x1, y0, z0], [x1, y1, z0], [x1, y1, z1], [x1, y0, z1]], 0.6);
      if (eye[1] < y0) face([[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]], 0.66);
      if (eye[1] > y1) face([[x1, y1, z0], [x0, y1, z0], [x0, y1, z1], [x1, y1, z1]], 0.78);
      if (eye[2] > z1) face([[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]], 1);
    }
  }

  drawOutlines({ matrix }, { tall }) {
    const { context, episode: { cell } } = this;
    const point = ([r, c]) => this.project(matrix, [c * cell, r * cell, this.cornerHeight(r, c) * tall]);
    context.lineWidth = 2.5;
    for (const { style, edges } of this.outlines) {
      context.strokeStyle = style;
      context.beginPath();
      for (const [from, to] of edges.map((edge) => edge.map(point))) {
        if (from && to) { context.moveTo(from[0], from[1]); context.lineTo(to[0], to[1]); }
      }
      context.stroke();
    }
    context.lineWidth = 1;
  }

  cornerHeight(r, c) {
    const { rows, cols } = this.episode, { height } = this.surface;
    const r0 = Math.max(0, r - 1), r1 = Math.min(rows - 1, r), c0 = Math.max(0, c - 1), c1 = Math.min(cols - 1, c);
    return (height[r0 * cols + c0] + height[r0 * cols + c1] + height[r1 * cols + c0] + height[r1 * cols + c1]) / 4;
  }

  groundColor(r, c, tall) {
    const { cols, mask } = this.episode, k = r * cols + c, s = this.surface.shape;
    const share = s[4 * k + 3] / (Math.abs(s[4 * k + 3]) + 0.06);
    const paint = groundPaint(mask[k], share);
    const light = dot(unit([-s[4 * k] * tall * 1.3, -s[4 * k + 1] * tall * 1.3, 1]), SUN) / SUN[2];
    return css(paint, (0.4 + 0.62 * Math.max(0, light)) * s[4 * k + 2]);
  }

  drawShadow({ matrix }, { pose, tall }) {
    const shift = scale(SUN, -0.6 / SUN[2]), c = Math.cos(pose.heading), s = Math.sin(pose.heading);
    const { length, width } = this.machine;
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => {
      const ahead = a * length / 2, left = b * width / 2;
      return this.project(matrix, [pose.x + shift[0] + ahead * c - left * s, pose.y + shift[1] + ahead * s + left * c, pose.z * tall]);
    });
    this.fill(corners, "rgba(0, 0, 0, .35)", false);
  }

  drawModels({ matrix, eye }, { pose, tall }) {
    const place = placeMachine(pose, this.blade, tall), still = frame([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]);
    const seen = [];
    for (const [faces, model] of [[this.dozer, place.body], [this.front, place.blade], [this.blocks, still]]) {
      for (const { points, normal, paint } of faces) {
        const real = points.map((p) => transform(model, p).slice(0, 3));
        const n = sub(transform(model, normal).slice(0, 3), transform(model, [0, 0, 0]).slice(0, 3));
        if (dot(n, sub(eye, real[0])) <= 0) continue;
        const middle = scale(real.reduce(add), 1 / real.length);
        seen.push({ real, n, paint: paint || bladePaint(pose.edge), far: Math.hypot(...sub(eye, middle)) });
      }
    }
    seen.sort((a, b) => b.far - a.far);
    for (const { real, n, paint } of seen) {
      this.fill(real.map((p) => this.project(matrix, p)), css(paint, 0.5 + 0.55 * Math.max(0, dot(n, SUN))));
    }
  }

  fill(points, style, edge = true) {
    if (points.some((p) => p === null)) return;
    const { context } = this;
    context.beginPath();
    points.forEach((p, k) => (k ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
    context.closePath();
    context.fillStyle = style;
    context.strokeStyle = edge === true ? style : edge;
    context.fill();
    if (edge) context.stroke();
  }
}

// The cells' edges [[row, column], [row, column]] where a region ends.
function regionOutlines({ rows, cols, mask }) {
  const inside = (r, c, bit) => r >= 0 && c >= 0 && r < rows && c < cols && (mask[r * cols + c] & bit) > 0;
  return [[4, "#cc79a7"], [1, "#ffc83c"], [2, "#1f7fe0"]].map(([bit, style]) => {
    const edges = [];
    for (let r = 0; r <= rows; r++) for (let c = 0; c <= cols; c++) {
      if (inside(r, c, bit) !== inside(r - 1, c, bit)) edges.push([[r, c], [r, c + 1]]);
      if (inside(r, c, bit) !== inside(r, c - 1, bit)) edges.push([[r, c], [r + 1, c]]);
    }
    return { style, edges };
  });
}

function mixed(a, b, share) {
  return a.map((value, k) => value + share * (b[k] - value));
}

function css(paint, light) {
  return `rgb(${paint.map((value) => Math.round(255 * Math.min(1, value * light))).join(",")})`;
}
