// A camera that turns around a point; overview, follow and top are where it starts from.

const FIELD_OF_VIEW = 0.7;

class Camera {
  constructor(size) {
    this.size = size;
    this.view = "overview";
    this.reset("overview");
  }

  reset(view) {
    const [x, y] = this.size, long = Math.hypot(x, y);
    this.view = view;
    this.center = [x / 2, y / 2, 0];
    if (view === "overview") {
      Object.assign(this, { azimuth: -1.15, elevation: 0.62, distance: 1.12 * long + 4 });
      this.center = [x / 2 + 0.06 * long * Math.cos(this.azimuth), y / 2 + 0.06 * long * Math.sin(this.azimuth), 0];
    }
    if (view === "top") Object.assign(this, { azimuth: -Math.PI / 2, elevation: 1.5607, distance: 1.75 * Math.max(x / 1.5, y) + 2 });
    if (view === "follow") Object.assign(this, { azimuth: 0.45, elevation: 0.42, distance: 17, turned: null });
  }

  // Follow: keep the machine in the middle and turn slowly behind it; says whether there is still way to go.
  track(position, heading, seconds) {
    if (this.view !== "follow") return false;
    const behind = heading + Math.PI, first = this.turned === null;
    const ease = (time) => (first ? 1 : 1 - Math.exp(-seconds / time));
    this.turned = first ? behind : this.turned + ease(0.9) * wrap(behind - this.turned);
    this.center = add(this.center, scale(sub(position, this.center), ease(0.25)));
    return Math.abs(wrap(behind - this.turned)) > 1e-3 || Math.hypot(...sub(position, this.center)) > 1e-2;
  }

  turn(right, down) {
    this.azimuth -= right;
    this.elevation = Math.min(1.5607, Math.max(0.04, this.elevation + down));
  }

  move(right, down) {
    const step = this.distance * FIELD_OF_VIEW, a = this.heading();
    const [c, s] = [Math.cos(a), Math.sin(a)];
    const dx = -right * -s + down * -c, dy = -right * c + down * -s;
    this.center = [this.center[0] + step * dx, this.center[1] + step * dy, this.center[2]];
    if (this.view === "follow") { this.azimuth = a; this.view = "free"; }
  }

  zoom(factor) {
    const long = Math.hypot(...this.size);
    this.distance = Math.min(4 * long, Math.max(3, this.distance * factor));
  }

  heading() {
    return this.view === "follow" ? this.azimuth + (this.turned || 0) : this.azimuth;
  }

  eye(tall) {
    const a = this.heading(), e = this.elevation;
    const center = [this.center[0], this.center[1], this.center[2] * tall];
    return { center, eye: add(center, scale([Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)], this.distance)) };
  }

  matrix(aspect, tall) {
    const { center, eye } = this.eye(tall);
    const far = this.distance + 3 * Math.hypot(...this.size) + 50;
    const narrow = aspect < 1 ? 2 * Math.atan(Math.tan(FIELD_OF_VIEW / 2) / aspect) : FIELD_OF_VIEW;
    const look = lookAt(eye, center, [0, 0, 1]);
    return { matrix: multiply(perspective(narrow, aspect, Math.max(0.3, this.distance / 50), far), look), eye };
  }
}
