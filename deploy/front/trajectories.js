// The chosen plan on each map, up to the time cursor.

const trajectories = (() => {
  const [W, H] = [data.upper[0] - data.lower[0], data.upper[1] - data.lower[1]], N = data.robots.length;
  const box = document.getElementById("maps"), paths = new Map();
  const path = (i) => { if (!paths.has(i)) paths.set(i, unpack(points[i].q)); return paths.get(i); };

  const views = data.maps.map((map, m) => {
    const figure = element("figure"), title = element("h3", names[m]), value = element("small"), canvas = element("canvas");
    title.append(value); figure.append(title, canvas); box.append(figure);
    canvas.style.aspectRatio = `${W} / ${H}`; canvas.id = `map-${m}`;
    canvas.setAttribute("role", "img"); canvas.setAttribute("aria-label", `The chosen plan over the map of ${names[m]}`);
    const small = element("canvas"); small.width = map.width; small.height = map.height;
    return { canvas, value, small, grey: Uint8Array.from(atob(map.data), (c) => c.charCodeAt(0)) };
  });

  function restyle() {
    const [r, g, b] = colours.heat.split(",").map(Number);
    for (const { small, grey } of views) {
      const pixels = small.getContext("2d"), image = pixels.createImageData(small.width, small.height);
      for (let y = 0; y < small.height; y++) for (let x = 0; x < small.width; x++) // the image's first row is the upper one
        image.data.set([r, g, b, 0.75 * grey[(small.height - 1 - y) * small.width + x]], 4 * (y * small.width + x));
      pixels.putImageData(image, 0, 0);
    }
  }

  function draw() {
    const q = path(chosen.index), steps = q.length / 2 / N, now = Math.min(steps - 1, Math.round(cursor.t / play.dt));
    views.forEach(({ canvas, value, small }, m) => {
      value.textContent = `E ${number(points[chosen.index].vector[m])}`;
      const { context, width, height } = fit(canvas);
      if (!width) return;
      const px = (x) => ((x - data.lower[0]) / W) * width, py = (y) => (1 - (y - data.lower[1]) / H) * height;
      context.imageSmoothingEnabled = true; context.imageSmoothingQuality = "high"; context.drawImage(small, 0, 0, width, height);
      context.strokeStyle = colours.faint; context.lineWidth = 1; context.strokeRect(0.5, 0.5, width - 1, height - 1);
      context.fillStyle = `rgba(${colours.obstacle}, .55)`;
      for (const ring of data.obstacles) { context.beginPath(); for (const [x, y] of ring) context.lineTo(px(x), py(y)); context.closePath(); context.fill(); }
      for (let i = 0; i < N; i++) {
        const at = (k) => [px(q[2 * (k * N + i)]), py(q[2 * (k * N + i) + 1])];
        context.strokeStyle = robotColour(i);
        for (const [from, to, wide, alpha] of [[0, steps - 1, 1.2, 0.5], [0, now, 2.6, 1]]) {
          context.globalAlpha = alpha; context.lineWidth = wide; context.beginPath();
          for (let k = from; k <= to; k++) context.lineTo(...at(k));
          context.stroke();
        }
        context.globalAlpha = 1; context.lineWidth = 2;
        context.beginPath(); context.arc(...at(0), 5, 0, 2 * Math.PI); context.stroke();
        context.fillStyle = robotColour(i); context.beginPath(); context.arc(...at(now), 5, 0, 2 * Math.PI); context.fill();
      }
      canvas.dataset.points = steps;
    });
  }
  return { draw, restyle };
})();
