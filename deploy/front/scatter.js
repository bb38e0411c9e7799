// The front in two or three objectives.

const scatter = (() => {
  const canvas = document.getElementById("scatter");
  const axes = ["axis-x", "axis-y", "axis-z"].map((id) => document.getElementById(id));
  axes.forEach((select, a) => {
    if (a === 2) select.append(new Option("none", "-1"));
    names.forEach((name, m) => select.append(new Option(name, m)));
    select.value = String(a < names.length ? a : a === 2 ? -1 : 0);
    select.addEventListener("change", () => { yaw = null; soon(); });
  });
  let yaw = null, pitch = 0.45, places = [];
  const axis = (a) => Number(axes[a].value);
  const LEFT = 58, RIGHT = 22, TOP = 14, BOTTOM = 42;

  function flat(context, width, height) {
    const [a, b] = [axis(0), axis(1)], w = width - LEFT - RIGHT, h = height - TOP - BOTTOM;
    const px = (E) => LEFT + (E / (1.05 * worst[a] || 1)) * w, py = (E) => TOP + h - (E / (1.05 * worst[b] || 1)) * h;
    context.strokeStyle = colours.line; context.fillStyle = colours.soft; context.lineWidth = 1;
    context.textAlign = "center"; context.textBaseline = "top";
    for (const v of ticks(0, 1.05 * worst[a], 5)) {
      context.beginPath(); context.moveTo(px(v), TOP); context.lineTo(px(v), TOP + h); context.stroke();
      context.fillText(String(Number(v.toPrecision(6))), px(v), TOP + h + 5);
    }
    context.textAlign = "right"; context.textBaseline = "middle";
    for (const v of ticks(0, 1.05 * worst[b], 5)) {
      context.beginPath(); context.moveTo(LEFT, py(v)); context.lineTo(LEFT + w, py(v)); context.stroke();
      context.fillText(String(Number(v.toPrecision(6))), LEFT - 6, py(v));
    }
    context.textAlign = "center"; context.textBaseline = "bottom"; context.fillText(`E of ${names[a]}`, LEFT + w / 2, height - 4);
    context.save(); context.translate(12, TOP + h / 2); context.rotate(-Math.PI / 2); context.textBaseline = "middle"; context.fillText(`E of ${names[b]}`, 0, 0); context.restore();
    if (names.length === 2 && a !== b) { // statistics between the maps: √E + √E' is their distance
      const d2 = data.ideal[0][1] ** 2;
      context.setLineDash([5, 4]); context.strokeStyle = colours.soft; context.beginPath();
      for (let k = 0; k <= 60; k++) { const s = k / 60; context.lineTo(px(s * s * d2), py((1 - s) * (1 - s) * d2)); }
      context.stroke(); context.setLineDash([]);
    }
    return points.map((p, i) => [i, px(p.vector[a]), py(p.vector[b])]);
  }

  // From where the plans are seen farthest apart; fronts of maps that are alike are nearly flat.
  function widest(scaled) {
    const spread = (a) => { const r = scaled.map(([x, y]) => x * Math.cos(a) - y * Math.sin(a)); return Math.max(...r) - Math.min(...r); };
    return Array.from({ length: 12 }, (_, k) => -Math.PI / 2 + 0.15 + (k * Math.PI) / 12).reduce((a, b) => (spread(b) > spread(a) ? b : a));
  }

  function deep(context, width, height) {
    const picked = [axis(0), axis(1), axis(2)], size = Math.min(width, height) * 0.58;
    const scaled = points.map((p) => picked.map((m) => p.vector[m] / (worst[m] || 1)));
    yaw ??= widest(scaled);
    const project = (u) => {
      const [x, y, z] = u.map((v) => v - 0.5), r = x * Math.cos(yaw) - y * Math.sin(yaw), f = x * Math.sin(yaw) + y * Math.cos(yaw);
      return [width / 2 + size * r, height / 2 - size * (z * Math.cos(pitch) + f * Math.sin(pitch))];
    };
    context.strokeStyle = colours.faint; context.fillStyle = colours.soft; context.lineWidth = 1; context.textAlign = "center"; context.textBaseline = "middle";
    for (let from = 0; from < 8; from++) for (let d = 0; d < 3; d++) if (!(from & (1 << d))) {
      const corner = (k) => [k & 1, (k >> 1) & 1, (k >> 2) & 1];
      context.beginPath(); context.moveTo(...project(corner(from))); context.lineTo(...project(corner(from | (1 << d)))); context.stroke();
    }
    picked.forEach((m, d) => { const end = [0, 0, 0]; end[d] = d < 2 ? 1.14 : 1.07; context.fillText(`E of ${names[m]}`, ...project(end)); });
    const found = scaled.map((u, i) => [i, ...project(u)]);
    context.strokeStyle = colours.line;
    scaled.forEach((u, i) => { if (points[i].best) { context.beginPath(); context.moveTo(...project(u)); context.lineTo(...project([u[0], u[1], 0])); context.stroke(); } });
    return found;
  }

  function draw() {
    const { context, width, height } = fit(canvas);
    if (!width) return;
    context.font = FONT;
    places = (axis(2) < 0 ? flat : deep)(context, width, height);
    for (const [i, x, y] of places) if (i !== chosen.index) dot(context, i, x, y);
    dot(context, ...places[chosen.index]);
    canvas.dataset.points = places.length;
  }

  let held = null;
  canvas.addEventListener("pointerdown", (e) => { held = { x: e.offsetX, y: e.offsetY, yaw, pitch, moved: false }; canvas.setPointerCapture?.(e.pointerId); });
  canvas.addEventListener("pointermove", (e) => {
    if (!held || axis(2) < 0) return;
    const dx = e.offsetX - held.x, dy = e.offsetY - held.y;
    held.moved ||= Math.hypot(dx, dy) > 4;
    if (held.moved) { yaw = held.yaw + dx / 120; pitch = Math.min(1.5, Math.max(-0.2, held.pitch + dy / 120)); soon(); }
  });
  canvas.addEventListener("pointerup", () => setTimeout(() => { held = null; }));
  canvas.addEventListener("click", (e) => {
    if (held?.moved) return;
    const found = nearest(places, e.offsetX, e.offsetY);
    if (found !== null) chosen.set(found);
  });
  canvas.addEventListener("keydown", (e) => {
    const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[e.key];
    if (by) { chosen.step(by); e.preventDefault(); e.stopPropagation(); }
  });
  return { draw, place: (i) => places[i].slice(1) };
})();
