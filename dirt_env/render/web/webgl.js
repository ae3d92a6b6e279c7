// Draws with the graphics card. Throws where that cannot be done.

class GlRenderer {
  constructor(canvas, machine, blade) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("no WebGL2");
    Object.assign(this, { gl, canvas, machine, blade, name: "webgl2" });
    this.ground = compile(gl, GROUND_VERTEX, GROUND_FRAGMENT);
    this.cell = compile(gl, CELL_VERTEX, CELL_FRAGMENT);
    this.model = compile(gl, MODEL_VERTEX, MODEL_FRAGMENT);
    this.dozer = upload(gl, this.model, dozerFaces(machine));
    this.front = upload(gl, this.model, bladeFaces(blade, machine));
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
  }

  setEpisode(episode) {
    const { gl } = this, { rows, cols } = episode;
    this.episode = episode;
    this.surface = new Surface(episode);
    this.surface.update(0, 0);
    this.heights = texture(gl, 0, gl.R32F, cols, rows, gl.NEAREST);
    this.shape = texture(gl, 1, gl.RGBA16F, cols, rows, gl.LINEAR);
    const { pixels, wide, high } = regionPixels(episode);
    this.regions = texture(gl, 2, gl.RGBA8, wide, high, gl.LINEAR);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, wide, high, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    this.fine = Math.max(1, Math.min(4, Math.floor(384 / Math.max(rows, cols))));
    this.grid = gridMesh(gl, cols * this.fine + 1, rows * this.fine + 1);
    this.wall = wallMesh(gl, this.ground, cols, rows, this.fine);
    this.tall = null;
    this.fresh = true;
    this.cells = episode.voxels ? new CellBoxes(episode) : null;
    this.stones = this.cells && (this.stones || boxMesh(gl, this.cell));
  }

  draw(camera, moment) {
    const { gl, canvas, episode } = this;
    if (this.surface.update(moment.first, moment.share) || this.fresh) this.uploadSurface();
    this.fresh = false;
    if (this.tall !== moment.tall) {
      this.tall = moment.tall;
      this.blocks = upload(gl, this.model, obstacleFaces(episode, this.surface.height, moment.tall), this.blocks);
    }
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const { matrix } = camera.matrix(canvas.width / canvas.height, moment.tall);
    if (moment.cells) this.drawCells(matrix, moment);
    else this.drawGround(matrix, moment);
    this.drawModels(matrix, moment);
  }

  uploadSurface() {
    const { gl, episode: { rows, cols } } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, cols, rows, gl.RED, gl.FLOAT, this.surface.height);
    gl.activeTexture(gl.TEXTURE1);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, cols, rows, gl.RGBA, gl.FLOAT, this.surface.shape);
  }

  drawCells(matrix, { first, share, pose, tall }) {
    const { gl, cells, stones } = this, at = this.cell.at;
    gl.useProgram(this.cell.program);
    gl.bindVertexArray(stones.vertices);
    if (cells.update(first, share, this.surface.height)) {
      gl.bindBuffer(gl.ARRAY_BUFFER, stones.buffer);
      gl.bufferData(gl.ARRAY_BUFFER, cells.boxes.subarray(0, BOX * cells.count), gl.DYNAMIC_DRAW);
    }
    gl.uniformMatrix4fv(at.u_view, false, matrix);
    gl.uniform1f(at.u_tall, tall); gl.uniform1f(at.u_cell, this.episode.cell);
    this.setShadow(at, pose);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 36, cells.count);
  }

  setShadow(at, pose) {
    const { gl, machine, blade } = this;
    gl.uniform2f(at.u_half, machine.length / 2, machine.width / 2);
    gl.uniform2f(at.u_blade, blade.reach, blade.width / 2);
    gl.uniform4f(at.u_pose, pose.x, pose.y, Math.cos(pose.heading), Math.sin(pose.heading));
    gl.uniform1f(at.u_edge, pose.edge);
  }

  drawGround(matrix, { pose, tall }) {
    const { gl, episode } = this, { rows, cols, cell } = episode, at = this.ground.at;
    gl.useProgram(this.ground.program);
    gl.uniformMatrix4fv(at.u_view, false, matrix);
    gl.uniform1i(at.u_height, 0); gl.uniform1i(at.u_shape, 1); gl.uniform1i(at.u_regions, 2);
    gl.uniform1f(at.u_tall, tall); gl.uniform1f(at.u_cell, cell); gl.uniform1f(at.u_base, baseOf(episode));
    gl.uniform2i(at.u_cells, cols, rows); gl.uniform1i(at.u_fine, this.fine);
    gl.uniform2f(at.u_site, cols * cell, rows * cell);
    gl.uniform3f(at.u_high, episode.range[0], episode.range[1], 0);
    gl.uniform1f(at.u_interval, contourInterval(episode));
    this.setShadow(at, pose);
    for (const [mesh, wall] of [[this.grid, 0], [this.wall, 1]]) {
      gl.uniform1i(at.u_wall, wall);
      gl.bindVertexArray(mesh.vertices);
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    }
  }

  drawModels(matrix, { pose, tall, driven }) {
    const { gl } = this, at = this.model.at, place = placeMachine(pose, this.blade, tall);
    gl.useProgram(this.model.program);
    gl.uniformMatrix4fv(at.u_view, false, matrix);
    gl.uniform3fv(at.u_paint, bladePaint(pose.edge));
    gl.uniform1f(at.u_driven, driven);
    const still = frame([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]);
    for (const [mesh, model] of [[this.dozer, place.body], [this.front, place.blade], [this.blocks, still]]) {
      if (!mesh.count) continue;
      gl.uniformMatrix4fv(at.u_model, false, model);
      gl.bindVertexArray(mesh.vertices);
      gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
    }
  }
}

function baseOf({ range, rows, cols, cell }) {
  return range[0] - Math.max(0.6, 0.035 * Math.max(rows, cols) * cell);
}

function contourInterval({ target }) {
  let low = Infinity, high = -Infinity;
  for (const value of target) { low = Math.min(low, value); high = Math.max(high, value); }
  return [0.25, 0.5, 1, 2.5, 5, 10, 25, 50, 100].find((step) => step >= (high - low) / 12) || 250;
}

function compile(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "shader");
  const at = {};
  for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
    const { name } = gl.getActiveUniform(program, k);
    at[name] = gl.getUniformLocation(program, name);
  }
  return { program, at };
}

function texture(gl, place, format, wide, high, filter) {
  const made = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + place);
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, wide, high);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, filter);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  return made;
}

// Faces (convex polygons) as triangles on the card: point, normal, paint and band; a paint of null is told per draw.
function upload(gl, { program }, faces, old) {
  const numbers = [];
  for (const { points, normal, paint, band } of faces) {
    for (let k = 1; k + 1 < points.length; k++) {
      for (const point of [points[0], points[k], points[k + 1]]) numbers.push(...point, ...normal, ...(paint || [-1, 0, 0]), band);
    }
  }
  if (old) { gl.deleteVertexArray(old.vertices); gl.deleteBuffer(old.buffer); }
  const vertices = gl.createVertexArray(), buffer = gl.createBuffer();
  gl.bindVertexArray(vertices);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STATIC_DRAW);
  for (const [name, size, offset] of [["a_point", 3, 0], ["a_normal", 3, 12], ["a_paint", 4, 24]]) {
    const at = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 40, offset);
  }
  return { vertices, buffer, count: numbers.length / 10 };
}

// One box, drawn for each of the cells whose numbers are put into the buffer.
function boxMesh(gl, { program }) {
  const vertices = gl.createVertexArray(), buffer = gl.createBuffer();
  gl.bindVertexArray(vertices);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  for (const [name, size, offset] of [["a_place", 4, 0], ["a_paint", 3, 16]]) {
    const at = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 4 * BOX, offset);
    gl.vertexAttribDivisor(at, 1);
  }
  return { vertices, buffer };
}

function gridMesh(gl, wide, high) {
  const index = new Uint32Array(6 * (wide - 1) * (high - 1));
  for (let r = 0, k = 0; r + 1 < high; r++) for (let c = 0; c + 1 < wide; c++) {
    const a = r * wide + c;
    index.set([a, a + 1, a + wide + 1, a, a + wide + 1, a + wide], k);
    k += 6;
  }
  const vertices = gl.createVertexArray();
  gl.bindVertexArray(vertices);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
  return { vertices, count: index.length };
}

// The sides of the block of earth: points (column, row, 1 at the bottom) around the border.
function wallMesh(gl, { program }, cols, rows, fine) {
  const points = [], index = [];
  const line = (from, to, steps) => {
    for (let k = 0; k <= steps; k++) {
      const at = [0, 1].map((axis) => from[axis] + (to[axis] - from[axis]) * k / steps);
      const last = points.length / 3;
      points.push(...at, 0, ...at, 1);
      if (k > 0) index.push(last - 2, last - 1, last, last, last - 1, last + 1);
    }
  };
  line([0, 0], [cols, 0], cols * fine); line([cols, 0], [cols, rows], rows * fine);
  line([cols, rows], [0, rows], cols * fine); line([0, rows], [0, 0], rows * fine);
  const vertices = gl.createVertexArray();
  gl.bindVertexArray(vertices);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points), gl.STATIC_DRAW);
  const at = gl.getAttribLocation(program, "a_at");
  gl.enableVertexAttribArray(at);
  gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(index), gl.STATIC_DRAW);
  return { vertices, count: index.length };
}
