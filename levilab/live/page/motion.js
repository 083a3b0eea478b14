// The levitating top in three dimensions, from the poses that the virtual bench publishes.
//
// Poses come in pieces, 400 a second of the bench. The page plays them a little late and turns the top between two of
// them, so that it moves evenly however often messages come. Slower than the bench, it plays what it has kept, and
// goes on from the newest when that is at its end.

import {buildCamera, buildScene, pixelOf, placeCamera} from "./top.js";
import {SOFTWARE} from "./plot.js";

/** Poses that are kept: at most 20 s of the bench's time. */
const KEPT = 8000;
/** Least mean time between pictures without a graphics card [ms]: the screen's own times are 17 ms apart. */
const LEAST_MS = SOFTWARE ? 46 : 0;

/** Pixels without a graphics card, as a part of those that are shown: half would do, but is coarse to look at. */
const SOFTWARE_RATIO = 0.75;

/** @param description of the top and its base, as the server sends it. */
export async function openSpace(canvas, description) {
  const {THREE, OrbitControls} = await import("./three.js");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const renderer = new THREE.WebGLRenderer({canvas, antialias: !SOFTWARE, powerPreference: "low-power"});
  renderer.setPixelRatio(SOFTWARE ? SOFTWARE_RATIO : Math.min(devicePixelRatio || 1, 2));
  let parts = null, view = null;
  function build(described) {
    view?.dispose();
    parts = described;
    view = buildScene(THREE, parts, dark.matches ? "dark" : "light");
    view.show({drive: false});
  }
  build(description);
  const camera = buildCamera(THREE, parts, 1);
  const orbit = new OrbitControls(camera, canvas);
  orbit.target.copy(camera.userData.target);
  orbit.enablePan = orbit.enableZoom = false;
  orbit.minPolarAngle = 0.2;
  orbit.maxPolarAngle = 1.65;
  orbit.addEventListener("change", () => { moved = true; });
  dark.addEventListener("change", () => {
    view.setTheme(dark.matches ? "dark" : "light");
    moved = true;
  });

  const [one, two] = [new THREE.Quaternion(), new THREE.Quaternion()];
  let times = [], places = [], turns = [], ups = [];
  let playhead = NaN, last = 0, drawnAt = 0, moved = true, rate = 1, speed = 1, paused = false, frames = 0;

  function add(start, step, position, quaternion, up) {
    if (times.length && start < times.at(-1) - 1e-9) [times, places, turns, ups] = [[], [], [], []];  // a new bench
    for (let k = 0; k < up.length; k += 1) {
      times.push(start + k * step);
      places.push(position.subarray(3 * k, 3 * k + 3));
      turns.push(quaternion.subarray(4 * k, 4 * k + 4));
      ups.push(up[k] !== 0);
    }
    if (times.length > KEPT) for (const list of [times, places, turns, ups]) list.splice(0, list.length - KEPT);
  }

  /** Move the playhead on by these seconds on the wall [s]. */
  function advance(seconds) {
    const newest = times.at(-1), late = 0.12 * speed;
    if (!(playhead >= times[0] && playhead <= newest)) playhead = Math.max(times[0], newest - late);
    playhead += seconds * speed * rate;
    if (rate === 1) {
      const off = newest - late - playhead;
      playhead += Math.abs(off) > 0.5 * speed ? off : 0.1 * off;
    } else if (playhead < times[0]) playhead = newest;
    playhead = Math.min(Math.max(playhead, times[0]), newest);
  }

  function show() {
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= playhead) low = middle;
      else high = middle;
    }
    const share = times[high] > times[low] ? (playhead - times[low]) / (times[high] - times[low]) : 0;
    one.fromArray(turns[low]);
    two.fromArray(turns[high]);
    const about = two.clone().multiply(one.clone().invert());
    const axis = view.axisEnd([0, 0, 0], turns[low]);
    view.setSpin(ups[low] ? Math.sign((about.x * axis[0] + about.y * axis[1] + about.z * axis[2]) * about.w) : 0);
    const place = places[low].map((value, k) => value + share * (places[high][k] - value));
    view.setPose(place, one.slerp(two, share).toArray());
    const there = ups[low] || place[2] !== 0;  // else it was taken away
    view.show({top: there});
    return {place, up: ups[low], there, time: playhead};
  }

  function resize() {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height) return;
    renderer.setSize(width, height, false);
    placeCamera(THREE, camera, parts, width / height);
    view.setPixel(pixelOf(camera, height * renderer.getPixelRatio()));
    moved = true;
  }
  new ResizeObserver(resize).observe(canvas);
  resize();

  let state = null;
  function draw(now) {
    requestAnimationFrame(draw);
    if (document.hidden || now - drawnAt < LEAST_MS) return;
    const seconds = Math.min((now - last) / 1000, 0.25);
    last = now;
    if (times.length && !paused && rate > 0) {
      const before = playhead;
      advance(seconds);
      if (playhead !== before || !state) {
        state = show();
        moved = true;
      }
    }
    if (!moved) return;
    moved = false;
    drawnAt = Math.max(drawnAt + LEAST_MS, now - LEAST_MS / 2);
    renderer.render(view.scene, camera);
    frames += 1;
  }
  requestAnimationFrame(draw);

  return {
    add,
    get parts() { return parts; },
    setParts: (described) => {
      if (JSON.stringify(described) === JSON.stringify(parts)) return;
      build(described);
      resize();
      if (!state) return;
      advance(0);  // the poses may have begun again, and a picture that stands still has not followed
      state = show();
    },
    setRate: (value) => { rate = value; },
    setSpeed: (value, still) => { speed = still ? 0 : value || 1; },
    pause: (value) => { paused = value; },
    turn: (angle) => {
      const offset = camera.position.clone().sub(orbit.target).applyAxisAngle(new THREE.Vector3(0, 0, 1), angle);
      camera.position.copy(orbit.target).add(offset);
      camera.lookAt(orbit.target);
      moved = true;
    },
    get state() { return state; },
    get frames() { return frames; },
  };
}
