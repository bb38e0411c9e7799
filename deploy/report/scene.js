// The flight in three dimensions: an orthographic view, so that the floor's image needs one affine transform only.

const scene = (() => {
  const canvas = document.getElementById("scene");
  let flown = unpack(play.flown), planned = unpack(play.planned);
  const N = play.robots.length;
  const lower = play.lower, upper = play.upper;
  const centre = [(lower[0] + upper[0]) / 2, (lower[1] + upper[1]) / 2, upper[2] / 2];
  const HOME = { yaw: -0.55, pitch: 0.72, zoom: 1, panX: 0, panY: 0 };
  const camera = { ...HOME };
  let project = null, scale = 1, heat = null;

  const index = () => Math.min(play.n - 1, Math.max(0, Math.round((cursor.t - play.t0) / play.dt)));
  const at = (positions, k, i) => {
    const o = 3 * (k * N + i);
    return [positions[o], positions[o + 1], positions[o + 2]];
  };
  const known = (p) => !Number.isNaN(p[0]);

  function view(p, yaw, pitch) {
    const c = Math.cos(yaw), s = Math.sin(yaw), sp = Math.sin(pitch), cp = Math.cos(pitch);
    const x = p[0] - centre[0], y = p[1] - centre[1], z = p[2] - centre[2], depth = c * y - s * x;
    return [c * x + s * y, z * cp + depth * sp, depth * cp - z * sp];
  }

  // The scale fits the box as seen at first, and stays when the view turns: turning does not breathe.
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => view([k & 1 ? upper[0] : lower[0], k & 2 ? upper[1] : lower[1], k & 4 ? upper[2] : 0], HOME.yaw, HOME.pitch));
  const extent = [0, 1].map((d) => [Math.min(...corners.map((p) => p[d])), Math.max(...corners.map((p) => p[d]))]);
  const middle = (extent[1][0] + extent[1][1]) / 2;

  function aim(width, height) {
    const room = Math.min(width / (extent[0][1] - extent[0][0]), height / (extent[1][1] - extent[1][0]));
    scale = camera.zoom * 0.86 * room;
    project = (p) => {
      const v = view(p, camera.yaw, camera.pitch);
      return [width / 2 + camera.panX + v[0] * scale, height / 2 + camera.panY - (v[1] - middle) * scale, v[2]];
    };
  }

  function paintHeat() {
    const { width, height, data: text } = play.heat;
    const values = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    heat = document.createElement("canvas");
    heat.width = width; heat.height = height;
    const context = heat.getContext("2d"), image = context.createImageData(width, height);
    const [r, g, b] = colours.heat.split(",").map(Number);
    for (let k = 0; k < values.length; k++) image.data.set([r, g, b, values[k] * 0.55], 4 * k);
    context.putImageData(image, 0, 0);
  }

  function path(context, points, close) {
    context.beginPath();
    points.forEach((p, k) => (k ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
    if (close) context.closePath();
  }

  function drawFloor(context) {
    const o = project([lower[0], lower[1], 0]), x = project([upper[0], lower[1], 0]), y = project([lower[0], upper[1], 0]);
    context.save();
    context.transform((x[0] - o[0]) / heat.width, (x[1] - o[1]) / heat.width, (y[0] - o[0]) / heat.height, (y[1] - o[1]) / heat.height, o[0], o[1]);
    context.imageSmoothingEnabled = true;
    context.drawImage(heat, 0, 0);
    context.restore();
    context.strokeStyle = colours.line; context.lineWidth = 1;
    const step = ticks(0, Math.max(upper[0] - lower[0], upper[1] - lower[1]), 7)[1] || 1;
    for (let v = Math.ceil(lower[0] / step) * step; v <= upper[0] + 1e-9; v += step) { path(context, [project([v, lower[1], 0]), project([v, upper[1], 0])]); context.stroke(); }
    for (let v = Math.ceil(lower[1] / step) * step; v <= upper[1] + 1e-9; v += step) { path(context, [project([lower[0], v, 0]), project([upper[0], v, 0])]); context.stroke(); }
    context.strokeStyle = colours.soft; context.lineWidth = 1.25;
    path(context, [o, x, project([upper[0], upper[1], 0]), y], true);
    context.stroke();
    context.fillStyle = colours.soft; context.font = FONT; context.textAlign = "center"; context.textBaseline = "middle";
    const label = (text, p) => { const q = project(p); context.fillText(text, q[0], q[1]); };
    const far = 0.06 * Math.max(upper[0] - lower[0], upper[1] - lower[1]);
    label("x " + (+upper[0].toFixed(2)) + " m", [upper[0], lower[1] - far, 0]);
    label("y " + (+upper[1].toFixed(2)) + " m", [lower[0] - far, upper[1], 0]);
    label((+lower[0].toFixed(2)) + ", " + (+lower[1].toFixed(2)), [lower[0] - far * 0.7, lower[1] - far * 0.7, 0]);
  }

  function hull(points) {
    const sorted = points.slice().sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const half = (list) => {
      const out = [];
      for (const p of list) {
        while (out.length > 1) {
          const [a, b] = out.slice(-2);
          if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
          out.pop();
        }
        out.push(p);
      }
      return out.slice(0, -1);
    };
    return half(sorted).concat(half(sorted.reverse()));
  }

  function drawObstacle(context, obstacle) {
    const ring = (z) => obstacle.ring.map(([x, y]) => project([x, y, z]));
    const bottom = ring(obstacle.low), top = ring(obstacle.high === null ? upper[2] * 1.15 : obstacle.high);
    context.fillStyle = `rgba(${colours.obstacle}, .16)`; context.strokeStyle = `rgba(${colours.obstacle}, .55)`; context.lineWidth = 1;
    path(context, hull(bottom.concat(top)), true); context.fill(); context.stroke();
    path(context, top, true); context.fillStyle = `rgba(${colours.obstacle}, .18)`; context.fill(); context.stroke();
  }

  function line(context, positions, i, from, to) {
    context.beginPath();
    let pen = false;
    for (let k = from; k <= to; k++) {
      const p = at(positions, k, i);
      if (!known(p)) { pen = false; continue; }
      const q = project(p);
      if (pen) context.lineTo(q[0], q[1]); else context.moveTo(q[0], q[1]);
      pen = true;
    }
    context.stroke();
  }

  function drawTrails(context, k) {
    const recent = Math.max(0, k - Math.round(3 / play.dt));
    context.lineJoin = context.lineCap = "round";
    for (let i = 0; i < N; i++) {
      if (focus.dims(i)) continue;
      context.strokeStyle = robotColour(i);
      if (document.getElementById("show-plan").checked) {
        context.globalAlpha = 0.45; context.lineWidth = 1; context.setLineDash([4, 4]);
        line(context, planned, i, 0, play.n - 1);
        context.setLineDash([]);
      }
      if (document.getElementById("show-trails").checked) {
        context.globalAlpha = 0.4; context.lineWidth = 1.5; line(context, flown, i, 0, k);
        context.globalAlpha = 1; context.lineWidth = 2.5; line(context, flown, i, recent, k);
      }
    }
    context.globalAlpha = 1;
  }

  // Discs of half the range: those of two robots of one height touch when the robots are within range.
  function drawRange(context, k) {
    if (play.range === null || !document.getElementById("show-range").checked) return;
    for (let i = 0; i < N; i++) {
      const p = at(flown, k, i);
      if (!known(p) || p[2] <= 0.1 || focus.dims(i)) continue;
      const ring = Array.from({ length: 40 }, (_, s) => project([p[0] + 0.5 * play.range * Math.cos(s * Math.PI / 20), p[1] + 0.5 * play.range * Math.sin(s * Math.PI / 20), 0]));
      context.fillStyle = context.strokeStyle = robotColour(i); context.lineWidth = 1;
      path(context, ring, true);
      context.globalAlpha = 0.1; context.fill(); context.globalAlpha = 0.55; context.stroke(); context.globalAlpha = 1;
    }
  }

  // What is seen of the floor, as if the drone were level.
  const OUTLINES = {
    point: () => [[0, 0]],
    disc: (sees) => circle(sees.radius),
    cone: (sees, height) => circle(sees.slope * height),
    camera: () => [],
    window: ({ slopes: [a, b], yaw }, height) => [[a, b], [-a, b], [-a, -b], [a, -b]].map(([x, y]) => [height * (x * Math.cos(yaw) - y * Math.sin(yaw)), height * (x * Math.sin(yaw) + y * Math.cos(yaw))]),
  };
  const circle = (radius) => Array.from({ length: 40 }, (_, s) => [radius * Math.cos(s * Math.PI / 20), radius * Math.sin(s * Math.PI / 20)]);

  // The object: its surface as discs, farthest first. Who saw a point first lends it his colour; the fuller, the more
  // information is on it. With a robot in focus, what he saw.
  const thing = play.thing && {
    points: unpack(play.thing.points), normals: unpack(play.thing.normals), share: unpack(play.thing.share),
    first: play.thing.first && unpack(play.thing.first),
  };
  function finder(j) {
    const count = thing.share.length;
    let who = null, since = Infinity;
    for (let i = 0; thing.first && i < N; i++) {
      const t = thing.first[i * count + j];
      if (!focus.dims(i) && t <= cursor.t + 1e-6 && t < since) { who = i; since = t; }
    }
    return who;
  }
  function drawThing(context) {
    if (!thing) return;
    const order = [], o = view(centre, camera.yaw, camera.pitch);
    for (let j = 0; j < thing.share.length; j++) {
      const p = thing.points.subarray(3 * j, 3 * j + 3), n = thing.normals.subarray(3 * j, 3 * j + 3);
      const facing = -(view([centre[0] + n[0], centre[1] + n[1], centre[2] + n[2]], camera.yaw, camera.pitch)[2] - o[2]);
      if (facing > 0 || play.thing.sided === 2) order.push([j, project(p), Math.abs(facing)]);
    }
    order.sort((a, b) => b[1][2] - a[1][2]);
    const radius = 1.15 * play.thing.radius * scale;
    for (const [j, q, facing] of order) {
      const who = finder(j);
      context.beginPath(); context.arc(q[0], q[1], radius, 0, 2 * Math.PI);
      context.fillStyle = colours.card; context.globalAlpha = 1; context.fill();
      context.fillStyle = who === null ? colours.soft : robotColour(who);
      context.globalAlpha = (who === null ? 0.18 : 0.35 + 0.55 * Math.sqrt(thing.share[j])) * (0.55 + 0.45 * facing);
      context.fill();
    }
    context.globalAlpha = 1;
  }

  function drawSeen(context, k) {
    if (!play.sees.length || !document.getElementById("show-seen").checked) return;
    for (let i = 0; i < N; i++) {
      const p = at(flown, k, i);
      if (!known(p) || p[2] <= 0.1 || focus.dims(i)) continue;
      const outline = OUTLINES[play.sees[i].type](play.sees[i], p[2]);
      if (!outline.length) continue;
      const ring = outline.map(([x, y]) => project([p[0] + x, p[1] + y, 0]));
      context.fillStyle = context.strokeStyle = robotColour(i); context.lineWidth = 1.5;
      path(context, ring, true);
      context.globalAlpha = 0.25; context.fill(); context.globalAlpha = 0.8; context.stroke(); context.globalAlpha = 1;
    }
  }

  function drawEdges(context, k) {
    if (play.range === null || !document.getElementById("show-edges").checked) return;
    context.strokeStyle = colours.ink; context.lineWidth = 1.75;
    for (let i = 0; i < N; i++) for (let j = i + 1; j < N; j++) {
      const a = at(flown, k, i), b = at(flown, k, j);
      if (known(a) && known(b) && Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) <= play.range && Math.min(a[2], b[2]) > 0.1) {
        path(context, [project(a), project(b)]); context.stroke();
      }
    }
  }

  // The colour an LED ring was last told; null: none, or dark.
  function lightOf(i) {
    const told = ((play.lights || [])[i] || []).filter((row) => row[0] <= cursor.t + 1e-6).pop();
    return told && Math.max(told[1], told[2], told[3]) > 0 ? told.slice(1) : null;
  }

  function drawLight(context, q, light) {
    const brightness = Math.max(...light), hue = light.map((part) => Math.round(255 * part / brightness)).join(",");
    const glow = context.createRadialGradient(q[0], q[1], 6, q[0], q[1], 26);
    glow.addColorStop(0, `rgba(${hue}, ${0.45 + 0.5 * brightness / 255})`);
    glow.addColorStop(1, `rgba(${hue}, 0)`);
    context.fillStyle = glow;
    context.beginPath(); context.arc(q[0], q[1], 26, 0, 2 * Math.PI); context.fill();
  }

  function drawRobots(context, k) {
    const order = Array.from({ length: N }, (_, i) => i).filter((i) => known(at(flown, k, i)));
    order.sort((a, b) => project(at(flown, k, b))[2] - project(at(flown, k, a))[2]);
    for (let i = 0; i < N; i++) {
      const p = at(planned, k, i);
      if (!known(p) || focus.dims(i) || !document.getElementById("show-plan").checked) continue;
      const q = project(p);
      context.strokeStyle = robotColour(i); context.lineWidth = 1.5;
      context.beginPath(); context.arc(q[0], q[1], 9, 0, 2 * Math.PI); context.stroke();
    }
    for (const i of order) {
      const p = at(flown, k, i), q = project(p), ground = project([p[0], p[1], 0]), faded = focus.dims(i) ? 0.25 : 1;
      context.strokeStyle = colours.soft; context.globalAlpha = 0.5 * faded; context.lineWidth = 1;
      path(context, [q, ground]); context.stroke();
      context.fillStyle = colours.ink; context.globalAlpha = 0.18 * faded;
      context.beginPath(); context.ellipse(ground[0], ground[1], 7, 7 * Math.abs(Math.sin(camera.pitch)), 0, 0, 2 * Math.PI); context.fill();
      context.globalAlpha = faded;
      const light = lightOf(i);
      if (light) drawLight(context, q, light);
      context.fillStyle = robotColour(i);
      context.beginPath(); context.arc(q[0], q[1], 6, 0, 2 * Math.PI); context.fill();
      context.strokeStyle = colours.card; context.lineWidth = 1.5; context.stroke();
      context.font = "600 " + FONT; context.textAlign = "left"; context.textBaseline = "middle";
      context.strokeStyle = colours.card; context.lineWidth = 3; context.lineJoin = "round";
      context.strokeText(play.robots[i], q[0] + 13, q[1] - 9); context.fillText(play.robots[i], q[0] + 13, q[1] - 9);
      context.globalAlpha = 1;
    }
  }

  function drawClock() {
    const clock = document.getElementById("clock"), phase = play.phases.filter((p) => p.begin <= cursor.t + 1e-6).pop();
    clock.innerHTML = "<b></b><span></span>";
    clock.firstChild.textContent = cursor.t.toFixed(1) + " s";
    clock.lastChild.textContent = phase ? phase.name : "";
  }

  function draw() {
    const { context, width, height } = fit(canvas);
    if (!width) return;
    aim(width, height);
    const k = index();
    drawFloor(context);
    const depth = ({ ring }) => Math.max(...ring.map(([x, y]) => project([x, y, 0])[2]));
    const behind = play.obstacles.slice().sort((a, b) => depth(b) - depth(a));
    behind.forEach((obstacle) => drawObstacle(context, obstacle));
    drawThing(context);
    drawRange(context, k);
    drawSeen(context, k);
    drawTrails(context, k);
    drawEdges(context, k);
    drawRobots(context, k);
    drawClock();
  }

  function look(change) { Object.assign(camera, change); draw(); }

  let grip = null;
  canvas.addEventListener("pointerdown", (e) => { grip = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointerup", () => { grip = null; });
  canvas.addEventListener("pointercancel", () => { grip = null; });
  canvas.addEventListener("pointermove", (e) => {
    if (!grip) return;
    const dx = e.clientX - grip[0], dy = e.clientY - grip[1];
    grip = [e.clientX, e.clientY];
    if (e.shiftKey || e.buttons & 2) look({ panX: camera.panX + dx, panY: camera.panY + dy });
    else look({ yaw: camera.yaw + dx * 0.008, pitch: Math.min(Math.PI / 2, Math.max(0.05, camera.pitch + dy * 0.008)) });
  });
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => {
    if (document.activeElement !== canvas && !e.ctrlKey) return; // scrolling past must not zoom
    e.preventDefault();
    look({ zoom: Math.min(12, Math.max(0.4, camera.zoom * Math.exp(-e.deltaY * 0.0015))) });
  }, { passive: false });
  document.getElementById("reset").addEventListener("click", () => look(HOME));
  document.getElementById("top").addEventListener("click", () => look({ ...HOME, yaw: 0, pitch: Math.PI / 2 }));
  document.getElementById("show-seen").closest("label").hidden = !play.sees.some((sees) => sees.type !== "camera");
  for (const id of ["show-plan", "show-trails", "show-edges", "show-range", "show-seen"]) document.getElementById(id).addEventListener("change", draw);

  const legend = document.getElementById("legend");
  play.robots.forEach((name, i) => {
    const item = element("li");
    item.append(robotButton(name, i));
    legend.append(item);
  });
  function feed(seen, wanted) { flown = seen; planned = wanted; } // a flight that is watched live
  return { draw, flown, restyle: paintHeat, feed };
})();
