// Put it together: what is said of the chosen plan, the table, time, theme.

const scrub = document.getElementById("scrub"), playButton = document.getElementById("play"), rows = [];
scrub.min = 0; scrub.max = tEnd;

for (const title of ["plan", "name", ...names.map((n) => `weight of ${n}`), ...names.map((n) => `E of ${n}`), "begun from", "search"])
  document.getElementById("columns").append(element("th", title));
points.forEach((p, i) => {
  const row = element("tr", undefined, p.best ? "" : "beaten");
  const cells = [i, p.name, ...p.weights.map((w) => w.toFixed(2)), ...p.vector.map(number), p.parent ?? "scratch", p.status];
  cells.forEach((text, c) => row.append(element("td", String(text), c > 1 && c < cells.length - 1 ? "n" : "")));
  row.tabIndex = 0;
  row.addEventListener("click", () => chosen.set(i));
  row.addEventListener("keydown", (e) => { if (e.key === "Enter" || e.key === " ") { chosen.set(i); e.preventDefault(); } });
  document.getElementById("rows").append(row); rows.push(row);
});
const buttons = Object.entries(data.named).map(([name, i]) => {
  const button = element("button", names.includes(name) ? `best on ${name}` : name);
  button.type = "button"; button.addEventListener("click", () => chosen.set(i));
  document.getElementById("named").append(button);
  return [button, i];
});

function words() {
  const p = points[chosen.index];
  document.getElementById("chosen-title").textContent = p.name ? `${label(chosen.index)} (plan ${chosen.index})` : label(chosen.index);
  const than = names.map((n, m) => { const least = Math.min(...points.map((o) => o.vector[m])); return `${n}: E ${number(p.vector[m])}${p.vector[m] > least ? `, best ${number(least)}` : ", the best there is"}`; });
  document.getElementById("chosen-reading").textContent = `${than.join(" · ")}${p.best ? "" : " · another plan is at least as good on every map"}`;
  document.getElementById("command").textContent = `ergoflie plan ${data.file} --pick ${chosen.index}`;
  rows.forEach((row, i) => row.setAttribute("aria-selected", String(i === chosen.index)));
  for (const [button, i] of buttons) button.setAttribute("aria-pressed", String(i === chosen.index));
}
function drawAll() {
  scatter.draw(); parallel.draw(); trajectories.draw(); words();
  scrub.value = cursor.t;
  document.getElementById("clock").textContent = `${cursor.t.toFixed(1)} s`;
}
let pending = false;
function soon() { // many changes within one frame are drawn once
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => { pending = false; drawAll(); });
}

let playing = false, before = 0;
function step() {
  if (!playing) return;
  const now = performance.now();
  cursor.set(cursor.t + Math.min(now - before, 250) / 1000 * 4); before = now;
  if (cursor.t >= tEnd) setPlaying(false); else setTimeout(step, 33);
}
function setPlaying(on) {
  playing = on; playButton.textContent = on ? "❚❚" : "▶"; playButton.setAttribute("aria-label", on ? "Pause" : "Play");
  if (!on) return;
  if (cursor.t >= tEnd - 1e-3) cursor.set(0);
  before = performance.now(); step();
}
playButton.addEventListener("click", () => setPlaying(!playing));
scrub.addEventListener("input", () => cursor.set(Number(scrub.value)));
document.getElementById("copy").addEventListener("click", async (e) => {
  const code = document.getElementById("command");
  try { await navigator.clipboard.writeText(code.textContent); e.target.textContent = "copied"; } catch { getSelection().selectAllChildren(code); }
  setTimeout(() => { e.target.textContent = "copy"; }, 1500);
});

function setTheme(name) { document.documentElement.dataset.theme = name; readColours(); trajectories.restyle(); drawAll(); }
const dark = window.matchMedia("(prefers-color-scheme: dark)");
document.getElementById("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
window.addEventListener("resize", soon);
cursor.listeners.push(soon); chosen.listeners.push(soon);
cursor.set(tEnd);
setTheme(document.documentElement.dataset.theme || (dark.matches ? "dark" : "light"));
chosen.set(chosen.index);
