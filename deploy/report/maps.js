// The map as given, as the metric sees it, what the flight made of it up to the cursor, and the difference: all in the metric's own cosine basis.

const maps = (() => {
  const about = data.maps;
  if (!about) return { draw() {} };
  const n = about.functions, SIDE = 72, EVERY = 64;
  const [W, H] = [about.upper[0] - about.lower[0], about.upper[1] - about.lower[1]];
  const columns = Math.round(SIDE * Math.min(1, W / H) / 2) * 2, rows = Math.round(SIDE * Math.min(1, H / W) / 2) * 2;
  const norm = (k) => (k === 0 ? 1 : Math.SQRT1_2);
  const table = (cells) => Array.from({ length: n }, (_, k) => Float64Array.from({ length: cells }, (_, c) => Math.cos(k * Math.PI * (c + 0.5) / cells) / norm(k)));
  const alongX = table(columns), alongY = table(rows);

  // Sums of the basis functions over all positions of the search, kept every EVERY samples: the cursor jumps freely.
  const first = Math.max(0, Math.ceil((0 - play.t0) / play.dt - 1e-6));
  const last = Math.min(play.n, Math.ceil((play.searched - play.t0) / play.dt - 1e-6));
  const flown = scene.flown, N = play.robots.length, kept = [];
  function add(sums, k) {
    let cx = 0, cy = 0, x0, x1, x2, y0, y1, y2, weight;
    for (let i = 0; i < N; i++) {
      const o = 3 * (k * N + i);
      if (Number.isNaN(flown[o])) continue;
      sums.count++;
      cx = Math.cos(Math.PI * (flown[o] - about.lower[0]) / W); cy = Math.cos(Math.PI * (flown[o + 1] - about.lower[1]) / H);
      x0 = 1; x1 = cx;
      for (let a = 0; a < n; a++) {
        weight = x0 / norm(a); y0 = 1; y1 = cy;
        for (let b = 0; b < n; b++) { sums.values[a * n + b] += weight * y0 / norm(b); y2 = 2 * cy * y1 - y0; y0 = y1; y1 = y2; }
        x2 = 2 * cx * x1 - x0; x0 = x1; x1 = x2;
      }
    }
  }
  const copy = (sums) => ({ values: sums.values.slice(), count: sums.count });
  const running = { values: new Float64Array(n * n), count: 0 };
  for (let k = first; k < last; k++) { if ((k - first) % EVERY === 0) kept.push(copy(running)); add(running, k); }

  // Robots that look down: sums over what they saw, worked out beforehand.
  function seen(t) {
    const latest = about.seen.t.findLastIndex((until) => until <= t + 1e-6);
    return t < 0 || latest < 0 ? null : Float64Array.from(about.seen.c[latest]);
  }

  function coefficients(t) {
    if (about.seen) return seen(t);
    const end = Math.min(last, Math.max(first, Math.floor((t - play.t0) / play.dt + 1e-6) + 1));
    if (end <= first) return null;
    const at = Math.min(kept.length - 1, Math.floor((end - first) / EVERY)), sums = copy(kept[at]);
    for (let k = first + at * EVERY; k < end; k++) add(sums, k);
    return sums.count ? sums.values.map((v) => v / sums.count) : null;
  }

  function density(c) {
    const out = new Float64Array(columns * rows), part = new Float64Array(n);
    for (let x = 0; x < columns; x++) {
      part.fill(0);
      for (let a = 0; a < n; a++) for (let b = 0; b < n; b++) part[b] += c[a * n + b] * alongX[a][x];
      for (let y = 0; y < rows; y++) { let v = 0; for (let b = 0; b < n; b++) v += part[b] * alongY[b][y]; out[y * columns + x] = v; }
    }
    return out;
  }

  const phi = Float64Array.from(about.phi), wanted = density(phi), top = Math.max(...wanted);
  const small = element("canvas"); small.width = columns; small.height = rows;
  function paint(id, values, colour) {
    const canvas = document.getElementById(id);
    canvas.style.aspectRatio = `${columns} / ${rows}`;
    const { context, width, height } = fit(canvas);
    if (!width) return;
    if (values) {
      const pixels = small.getContext("2d"), image = pixels.createImageData(columns, rows);
      for (let y = 0; y < rows; y++) for (let x = 0; x < columns; x++) {
        const v = values[(rows - 1 - y) * columns + x] / (top || 1); // the image's first row is the upper one
        image.data.set(colour(v), 4 * (y * columns + x));
      }
      pixels.putImageData(image, 0, 0);
      context.imageSmoothingEnabled = true; context.imageSmoothingQuality = "high";
      context.drawImage(small, 0, 0, width, height);
    }
    context.strokeStyle = colours.faint; context.lineWidth = 1; context.strokeRect(0.5, 0.5, width - 1, height - 1);
    context.strokeStyle = colours.soft;
    for (const obstacle of play.obstacles) {
      context.beginPath();
      for (const [x, y] of obstacle.ring) context.lineTo((x - about.lower[0]) / W * width, (1 - (y - about.lower[1]) / H) * height);
      context.closePath(); context.stroke();
    }
  }
  const rgb = (name) => colours[name].split(",").map(Number);
  const tint = (name) => { const [r, g, b] = rgb(name); return (v) => [r, g, b, 255 * Math.min(1, Math.max(0, v)) * 0.9]; };
  function signed(v) {
    const [r, g, b] = rgb(v > 0 ? "over" : "under");
    return [r, g, b, 255 * Math.min(1, Math.abs(v)) * 0.9];
  }

  // The map as it was given, at the same cells as its reconstruction beside it; its own brightness, not a density.
  const given = (() => {
    const { width, height, data: text } = about.given || play.heat, bytes = atob(text), out = new Float64Array(columns * rows);
    for (let x = 0; x < columns; x++) for (let y = 0; y < rows; y++) {
      const cell = Math.floor((y + 0.5) / rows * height) * width + Math.floor((x + 0.5) / columns * width);
      out[y * columns + x] = top * bytes.charCodeAt(cell) / 255;
    }
    return out;
  })();

  function draw() {
    const c = coefficients(cursor.t), made = c && density(c);
    paint("map-given", given, tint("heat"));
    paint("map-wanted", wanted, tint("heat"));
    paint("map-flown", made, tint("heat"));
    paint("map-difference", made && made.map((v, k) => v - wanted[k]), signed);
    const E = c ? c.reduce((sum, v, k) => sum + about.weights[k] * (v - phi[k]) ** 2, 0) : NaN;
    const said = document.getElementById("map-ergodicity");
    said.textContent = about.planar && c ? `E ≈ ${E.toExponential(2)} after ${Math.min(cursor.t, play.searched).toFixed(1)} s` : "";
    said.dataset.ergodicity = E;
  }
  return { draw };
})();
