// Parallel coordinates: an axis a map, a line a plan; and how much of each map has to be seen at least.

const parallel = (() => {
  const canvas = document.getElementById("parallel"), box = document.getElementById("limits");
  const outputs = names.map((name, m) => {
    const row = element("label"), input = element("input"), value = element("span");
    input.type = "range"; input.min = 0; input.max = 1; input.step = "any"; input.value = 1;
    input.setAttribute("aria-label", `largest E of ${name}`);
    // Squared: most plans worth telling apart are where E is small.
    input.addEventListener("input", () => { limits[m] = worst[m] * Number(input.value) ** 2; soon(); });
    row.append(element("span", name), input, value); box.append(row);
    return value;
  });
  const MARGIN = 46, TOP = 26, BOTTOM = 24;
  let lines = [];

  function draw() {
    const { context, width, height } = fit(canvas);
    if (!width) return;
    context.font = FONT;
    const px = (m) => (names.length < 2 ? width / 2 : MARGIN + (m * (width - 2 * MARGIN)) / (names.length - 1));
    const py = (m, E) => height - BOTTOM - Math.sqrt(E / (worst[m] || 1)) * (height - TOP - BOTTOM);
    lines = points.map((p, i) => [i, p.vector.map((E, m) => [px(m), py(m, E)])]);
    const order = lines.slice().sort(([i], [j]) => (i === chosen.index) - (j === chosen.index) || points[i].best - points[j].best);
    for (const [i, line] of order) {
      const is = i === chosen.index;
      context.globalAlpha = allowed(points[i]) ? (is ? 1 : points[i].best ? 0.55 : 0.25) : 0.06;
      context.strokeStyle = is ? colours.fail : points[i].best ? colours.accent : colours.soft; context.lineWidth = is ? 3 : 1.2;
      context.beginPath(); for (const [x, y] of line) context.lineTo(x, y); context.stroke();
    }
    context.globalAlpha = 1; context.lineWidth = 1;
    names.forEach((name, m) => {
      context.strokeStyle = colours.soft; context.beginPath(); context.moveTo(px(m), TOP); context.lineTo(px(m), height - BOTTOM); context.stroke();
      context.fillStyle = colours.ink; context.textAlign = "center"; context.textBaseline = "bottom"; context.fillText(name, px(m), TOP - 8);
      context.fillStyle = colours.soft; context.textBaseline = "top"; context.fillText("0", px(m), height - BOTTOM + 4);
      context.textAlign = "left"; context.textBaseline = "middle"; context.fillText(number(worst[m]), px(m) + 5, TOP + 4);
      outputs[m].textContent = `E ≤ ${number(limits[m])}`;
    });
    canvas.dataset.points = lines.length;
  }

  canvas.addEventListener("click", (e) => {
    let best = null, least = 14;
    for (const [i, line] of lines) for (let m = 0; m + 1 < line.length; m++) {
      const [[x0, y0], [x1, y1]] = [line[m], line[m + 1]];
      if (e.offsetX < x0 - 8 || e.offsetX > x1 + 8) continue;
      const away = Math.abs(y0 + ((y1 - y0) * (e.offsetX - x0)) / (x1 - x0) - e.offsetY);
      if (away < least && allowed(points[i])) { least = away; best = i; }
    }
    if (best !== null) chosen.set(best);
  });
  return { draw };
})();
