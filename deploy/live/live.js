// The flight as it comes over the socket, into what playback and charts draw.

(() => {
  const N = play.robots.length, duration = play.duration, chart = data.charts[0], panel = chart.panels[0], curve = panel.curves[0];
  const get = (id) => document.getElementById(id), root = document.documentElement.dataset;
  let first = null, zero = 0, phases = [], times = [], flown = [], planned = [], following = true, over = false, said = "";

  const follow = element("button", "live");
  follow.type = "button"; follow.id = "follow";
  get("bar").append(follow);
  function setFollowing(on) { following = on; follow.setAttribute("aria-pressed", String(on)); if (on) cursor.set(tEnd); }
  follow.addEventListener("click", () => setFollowing(true));
  // Whoever looks back is left there, until he comes to the end again or asks for it.
  const looked = () => setFollowing(cursor.t >= tEnd - 1.5 * play.dt);
  scrub.addEventListener("input", looked);
  button.addEventListener("click", () => setFollowing(false));
  document.addEventListener("keydown", (e) => { if (["ArrowLeft", "ArrowRight", "Home", "End"].includes(e.key)) looked(); });
  for (const id of ["scene", "phases", "chart-ergodicity"]) get(id).addEventListener("pointerdown", () => { if (id !== "scene") setTimeout(looked); });

  const cells = play.robots.map((name, i) => {
    const row = element("tr"), head = element("td"), rest = ["", "n", "n", "n", "note"].map((kind) => element("td", "", kind));
    head.append(robotButton(name, i));
    row.append(head, ...rest);
    get("table").append(row);
    return rest;
  });
  const figure = (value, digits, scale = 1) => (value === null ? "–" : (value * scale).toFixed(digits));

  function reset() {
    first = null; zero = 0; phases = []; times = []; flown = []; planned = []; said = "";
    curve.values = []; curve.times = []; get("said").replaceChildren();
  }

  function take(frame) {
    if (first === null) first = frame.t;
    if (frame.m !== null) zero = frame.t - frame.m;
    const k = Math.round((frame.t - first) / play.dt);
    while (flown.length < 3 * N * (k + 1)) { flown.push(NaN); planned.push(NaN); }
    frame.r.forEach((robot, i) => {
      for (let axis = 0; axis < 3; axis++) {
        flown[3 * (k * N + i) + axis] = robot && robot[0] ? robot[0][axis] : NaN;
        planned[3 * (k * N + i) + axis] = robot && robot[1] ? robot[1][axis] : NaN;
      }
    });
    if (!phases.length || phases[phases.length - 1].name !== frame.phase) phases.push({ name: frame.phase, begin: frame.t, end: frame.t });
    phases[phases.length - 1].end = frame.t;
    if (frame.e !== null) { times.push(frame.t); curve.values.push(frame.e); if (frame.certified > 0) panel.limits = [{ y: frame.certified, name: "certified" }]; }
    if (frame.text && frame.text !== said) {
      said = frame.text;
      get("said").prepend(element("li", `${frame.t.toFixed(1)} s  ${said}`));
      while (get("said").children.length > 300) get("said").lastChild.remove();
    }
    play.n = k + 1;
  }

  function show(frame) {
    play.t0 = first - zero; play.duration = zero ? duration : 0;
    tEnd = play.t0 + play.dt * (play.n - 1);
    play.phases = phases.map((p) => ({ name: p.name, begin: p.begin - zero, end: p.end - zero }));
    curve.times = times.map((t) => t - zero);
    panel.range = range(panel);
    get("chart-ergodicity").querySelector("canvas").dataset.points = times.length;
    scene.feed(flown, planned);
    scrub.min = play.t0; scrub.max = tEnd;
    get("phase").textContent = over ? `${frame.phase}: the flight is over` : frame.phase;
    get("message").textContent = said;
    frame.r.forEach((robot, i) => {
      const [state, volts, link, error, note] = cells[i];
      state.textContent = robot ? robot[2] || "–" : "left behind";
      volts.textContent = robot ? figure(robot[3], 2) : "–";
      link.textContent = robot ? figure(robot[4], 0) : "–";
      error.textContent = robot ? figure(robot[5], 1, 100) : "–";
      note.textContent = robot ? robot[6] : "";
    });
    root.frames = play.n;
    cursor.set(following ? tEnd : cursor.t);
  }

  let newest = null;
  function heard(message) {
    if (message.begin) { reset(); message.begin.forEach(take); newest = message.begin[message.begin.length - 1] || null; }
    else if (message.end) { over = true; root.live = "over"; }
    else { take(message); newest = message; }
    if (newest) show(newest);
  }

  function connect() {
    const socket = new WebSocket(`ws://${location.host}/feed`);
    socket.addEventListener("open", () => { root.live = "on"; });
    socket.addEventListener("message", (e) => heard(JSON.parse(e.data)));
    socket.addEventListener("close", () => {
      if (over) return;
      root.live = "lost"; get("message").textContent = "the connection is lost; trying again";
      setTimeout(connect, 1000);
    });
  }
  setFollowing(true);
  connect();
})();
