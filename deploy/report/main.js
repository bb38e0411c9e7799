// Put it together: theme, playback, keyboard.

const charts = data.charts.map(makeChart);
const scrub = document.getElementById("scrub"), button = document.getElementById("play"), speed = document.getElementById("speed");
scrub.min = play.t0; scrub.max = tEnd;

function drawAll() {
  scene.draw(); drawPhases();
  charts.forEach((draw) => draw());
  scrub.value = cursor.t;
}

// Many changes within one frame are drawn once.
let pending = false;
function soon() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => { pending = false; drawAll(); });
}

function setTheme(name) {
  document.documentElement.dataset.theme = name;
  readColours(); scene.restyle(); drawAll();
}

let playing = false, last = 0;
function step(now) {
  if (!playing) return;
  const t = cursor.t + (Math.min(now - last, 250) / 1000) * Number(speed.value);
  last = now;
  cursor.set(t);
  if (t >= tEnd) setPlaying(false); else requestAnimationFrame(step);
}
function setPlaying(on) {
  playing = on;
  button.textContent = on ? "❚❚" : "▶";
  button.setAttribute("aria-label", on ? "Pause" : "Play");
  if (!on) return;
  if (cursor.t >= tEnd - 1e-3) cursor.set(play.t0);
  requestAnimationFrame((now) => { last = now; requestAnimationFrame(step); });
}

button.addEventListener("click", () => setPlaying(!playing));
scrub.addEventListener("input", () => cursor.set(Number(scrub.value)));
document.getElementById("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
document.addEventListener("keydown", (e) => {
  const target = e.target;
  if (e.ctrlKey || e.metaKey || e.altKey || target.matches("select, summary, pre, input[type=checkbox]")) return;
  const moves = { ArrowLeft: -1, ArrowRight: 1 };
  if (e.key === " " && target.matches("button")) return; // a button's own key
  if (e.key === " ") setPlaying(!playing);
  else if (e.key in moves) cursor.set(cursor.t + moves[e.key] * (e.shiftKey ? 1 : 0.1));
  else if (e.key === "Home") cursor.set(play.t0);
  else if (e.key === "End") cursor.set(tEnd);
  else return;
  e.preventDefault();
});

follow(document.getElementById("phases"));
cursor.listeners.push(soon);
window.addEventListener("resize", soon);
const dark = window.matchMedia("(prefers-color-scheme: dark)");
dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
let before = "light";
window.addEventListener("beforeprint", () => { before = document.documentElement.dataset.theme; setTheme("light"); });
window.addEventListener("afterprint", () => setTheme(before));
setTheme(document.documentElement.dataset.theme || (dark.matches ? "dark" : "light"));
cursor.set(cursor.t);
