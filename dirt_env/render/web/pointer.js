// Mouse, pen and touch on a canvas: one pointer turns (or moves, with shift or the right button), two move and zoom.

function steer(canvas, cameras, changed) {
  const held = new Map();
  const spread = () => { const [a, b] = [...held.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
  const all = (action) => { cameras().forEach(action); changed(); };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, { x: event.clientX, y: event.clientY, pan: event.shiftKey || event.button > 0 });
  };
  canvas.onpointerup = canvas.onpointercancel = (event) => held.delete(event.pointerId);
  canvas.onpointermove = (event) => {
    const last = held.get(event.pointerId);
    if (!last) return;
    const right = (event.clientX - last.x) / canvas.clientHeight, down = (event.clientY - last.y) / canvas.clientHeight;
    const before = held.size > 1 ? spread() : 0;
    Object.assign(last, { x: event.clientX, y: event.clientY });
    const factor = held.size > 1 ? before / Math.max(1, spread()) : 1;
    if (held.size > 1) all((camera) => { camera.zoom(factor); camera.move(right / 2, down / 2); });
    else if (last.pan) all((camera) => camera.move(right, down));
    else all((camera) => camera.turn(4 * right, 3 * down));
  };
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    all((camera) => camera.zoom(Math.exp(0.0012 * event.deltaY * (event.deltaMode ? 30 : 1))));
  }, { passive: false });
}
