// Plays the poses of an animation's page: it reads them from the page, builds the top and moves it.
"use strict";
(async () => {
  const by = (id) => document.getElementById(id);
  const stage = by("stage");
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

  /** A module from its text: from a file a browser loads modules by such an address alone. */
  const load = async (text) => {
    const address = URL.createObjectURL(new Blob([text], {type: "text/javascript"}));
    try {
      return await import(address);
    } finally {
      URL.revokeObjectURL(address);
    }
  };
  const inflate = (packed) =>
    new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).text();

  const say = (text) => {
    by("problem").textContent = text;
    by("problem").hidden = false;
  };

  // --- what the page holds ---

  const data = JSON.parse(by("data").textContent);
  const {columns, count, start, step} = data;
  const values = new Float32Array(bytes(by("poses").textContent).buffer);
  const wide = columns.length;
  const place = Object.fromEntries(columns.map((name, k) => [name, k]));
  const column = (name, k) => (name in place ? values[k * wide + place[name]] : 0);

  let THREE, scene;
  let wanted = 0;
  const canvas = document.createElement("canvas");
  try {
    const library = await load(await inflate(bytes(by("three").textContent)));
    const {openStage} = await load(by("top").textContent);
    THREE = library.THREE;
    scene = openStage(THREE, library.OrbitControls, canvas, data.parts, {changed: () => redraw()});
  } catch (error) {
    say(`This browser does not draw in three dimensions (${error.message || error}), so the picture is still.`);
    return;
  }

  const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
  const {view, theme} = scene;

  by("still").remove();
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", data.alt);
  stage.prepend(canvas);
  for (const id of ["readout", "above", "controls"]) by(id).hidden = false;

  // --- poses between the poses ---

  const before = new THREE.Quaternion(), after = new THREE.Quaternion();

  /** The pose at a number of steps from the first, whole or not. */
  function poseAt(steps) {
    const k = Math.min(Math.floor(steps), count - 1), next = Math.min(k + 1, count - 1), share = steps - k;
    const between = (name) => column(name, k) + share * (column(name, next) - column(name, k));
    const turn = (into, row) => into.set(column("qx", row), column("qy", row), column("qz", row), column("qw", row));
    turn(before, k).normalize().slerp(turn(after, next).normalize(), share);
    return {
      position: [between("x"), between("y"), between("z")],
      quaternion: before.toArray(),
      spin: between("spin"), slip: between("slip"), drive: between("drive"),
    };
  }

  const trailLength = Math.max(2, Math.round(data.trail_s / step));
  const ends = new Float32Array(3 * count);
  function drawEnds() {
    for (let k = 0; k < count; k += 1) {
      const pose = poseAt(k);
      ends.set(view.axisEnd(pose.position, pose.quaternion), 3 * k);
    }
  }
  drawEnds();
  const trail = new Float32Array(3 * (trailLength + 2));

  // --- the picture ---

  let steps = 0, playing = false, last = 0, drawn = 0;

  function draw() {
    const pose = poseAt(steps);
    view.setPose(pose.position, pose.quaternion, {washers: pose.slip, drive: pose.drive});
    view.setSpin(Math.abs(pose.spin) < 1e-3 ? 0 : Math.sign(pose.spin));
    const k = Math.floor(steps), first = Math.max(0, k + 1 - trailLength), known = ends.subarray(3 * first, 3 * (k + 1));
    trail.set(known);
    trail.set(view.axisEnd(pose.position, pose.quaternion), known.length);
    view.setPath(trail, known.length / 3 + 1);
    scene.render();
    const tilt = Math.atan2(
      2 * Math.hypot(pose.quaternion[0] * pose.quaternion[2] + pose.quaternion[1] * pose.quaternion[3],
        pose.quaternion[1] * pose.quaternion[2] - pose.quaternion[0] * pose.quaternion[3]),
      1 - 2 * (pose.quaternion[0] ** 2 + pose.quaternion[1] ** 2));
    const read = {
      time: start + steps * step, height: 100 * pose.position[2], tilt: tilt / Math.PI * 180, spin: pose.spin,
      slip: pose.slip / 2 / Math.PI, drive: pose.drive * data.drive_mt,
    };
    for (const [name, digits] of data.readings) {
      by(`read-${name}`).textContent = read[name].toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−");
    }
    if (document.activeElement !== by("scrub") || playing) by("scrub").value = steps;
    by("scrub").setAttribute("aria-valuetext", `${read.time.toFixed(3)} s`);
    drawAbove(k, pose);
    stage.dataset.drawn = drawn += 1;
  }

  function redraw() {
    if (!wanted) wanted = requestAnimationFrame(tick);
  }

  function tick(now) {
    wanted = 0;
    if (playing) {
      // a page that was hidden goes on where it was
      const passed = Math.min(Math.max(now - last, 0), 100) / 1000;
      steps = Math.min(steps + passed * Number(by("speed").value) / step, count - 1);
      if (steps >= count - 1) play(false);
    }
    last = now;
    draw();
    if (playing) redraw();
  }

  // --- the path of the centre from above ---

  const flat = by("above").querySelector("canvas"), pen = flat.getContext("2d", {willReadFrequently: true});
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  for (let k = 0; k < count; k += 1) {
    ["x", "y"].forEach((name, i) => {
      low[i] = Math.min(low[i], column(name, k));
      high[i] = Math.max(high[i], column(name, k));
    });
  }
  const size = flat.width, scale = 0.86 * size / Math.max(high[0] - low[0], high[1] - low[1], 1e-6);
  const across = (x) => size / 2 + (x - (low[0] + high[0]) / 2) * scale;
  const down = (y) => size / 2 - (y - (low[1] + high[1]) / 2) * scale;
  by("scale").textContent = data.bar.text;

  function drawAbove(k, pose) {
    const colours = data.parts.colours[theme()];
    pen.fillStyle = colours.background;
    pen.fillRect(0, 0, size, size);
    pen.strokeStyle = colours.path;
    pen.lineWidth = 2;
    pen.beginPath();
    for (let i = Math.max(0, k - 4000); i <= k; i += 1) pen.lineTo(across(column("x", i)), down(column("y", i)));
    pen.lineTo(across(pose.position[0]), down(pose.position[1]));
    pen.stroke();
    pen.fillStyle = colours.mark;
    pen.beginPath();
    pen.arc(across(pose.position[0]), down(pose.position[1]), 6, 0, 7);
    pen.fill();
    pen.fillStyle = colours.text;
    pen.fillRect(size - 10 - data.bar.length * scale, size - 10, data.bar.length * scale, 3);
  }

  // --- what a person does ---

  function play(on) {
    playing = on;
    if (on && steps >= count - 1) steps = 0;
    by("play").querySelector("span").textContent = on ? "Pause" : "Play";
    by("play").querySelector("path").setAttribute("d", on ? "M3.5 2.5h3v11h-3zM9.5 2.5h3v11h-3z" : "M4 2.5v11l9-5.5z");
    last = performance.now();
    redraw();
  }

  function go(to) {
    steps = Math.min(Math.max(to, 0), count - 1);
    redraw();
  }

  function changeSpeed(by_) {
    const list = by("speed");
    list.selectedIndex = Math.min(Math.max(list.selectedIndex + by_, 0), list.options.length - 1);
    redraw();
  }

  function show(name) {
    view.show({[name]: by(`show-${name}`).checked});
    redraw();
  }

  const toggle = (name) => {
    by(`show-${name}`).checked = !by(`show-${name}`).checked;
    show(name);
  };

  by("scrub").max = count - 1;
  by("scrub").addEventListener("input", () => { play(false); go(Number(by("scrub").value)); });
  by("play").addEventListener("click", () => play(!playing));
  by("reset").addEventListener("click", scene.reset);
  by("speed").addEventListener("change", redraw);
  for (const name of ["path", "axis", "spin", "height"]) by(`show-${name}`).addEventListener("change", () => show(name));
  by("lean").addEventListener("change", () => {
    view.setLean(by("lean").checked ? 5 : 1);
    drawEnds();
    redraw();
  });

  const keys = {
    " ": () => play(!playing), k: () => play(!playing),
    ",": () => { play(false); go(Math.ceil(steps) - 1); }, ".": () => { play(false); go(Math.floor(steps) + 1); },
    "[": () => changeSpeed(1), "]": () => changeSpeed(-1),
    Home: () => go(0), End: () => go(count - 1), r: scene.reset,
    p: () => toggle("path"), a: () => toggle("axis"), s: () => toggle("spin"),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const at = event.target.tagName, key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    // what has the focus keeps the keys that it uses itself
    if (at === "SELECT" || (at === "BUTTON" && key === " ") || (at === "INPUT" && (key === " " || key.length > 1))) return;
    const action = keys[key];
    if (action) {
      event.preventDefault();
      action();
    }
  });

  play(!calm.matches);
})();
