// The top over its base in three dimensions, from the description that parts.py makes of a scene.
//
// Used by the page of an animation and by the live view.  It imports nothing: three.js is handed over, so that it may
// come from anywhere.  Lengths come in metres; z is up, as in the simulator.  A base of the usual size is drawn in
// centimetres, and another one as large, so that lines, cameras and shadows suit bases and tops of any size.
//
//     const stage = openStage(THREE, OrbitControls, canvas, parts, {changed});  // parts: what parts_of(scene) made
//     stage.view.setPose([x, y, z], [qx, qy, qz, qw], {washers: 0.1, drive: 0.5});
//     stage.render();

const REACH = 5.5;          // drawn units from the axis to the base's rim
const TURN = 2 * Math.PI;
const RIBBON = 0.028;       // half of the path's width, at least
const THINNEST = 1.6;       // pixels: a line that is thinner breaks into dashes
const AXIS = 0.022, PLUMB = 0.012, END = 0.075;  // radii of the lines and of the axis' end, at least
const SPIN = 0.05;          // half of the arrow's thickness, as a part of its radius
const AROUND = 96;          // facets around a part
const LEAN_MOST = 1.2;      // a lean that is exaggerated goes no further [rad]
const NEAREST = 6, FARTHEST = 120;  // distance of the camera, in drawn units
const CLOSE_SHARE = 0.38;   // width of the close-up, as a part of the picture's
const SEAM = 2;             // pixels of the page between the two
const CLOSE_ASPECT = 1.6;   // of a narrower picture the close-up would take what the base needs
const LEASH = 0.15;         // the close-up follows a top that moves further than this, as a part of half its length

/**
 * Build everything that is drawn.
 *
 * @param THREE the library.
 * @param parts the description of a scene, as parts_of makes it.
 * @param {"light"|"dark"} theme which of its colours.
 * @returns {object} scene (to render), top, washers, base (groups), half (of the length from tip to end of the axis, in
 *   drawn units), and functions:
 *   setPose(position [m], quaternion [x, y, z, w], {washers, drive}): place the top; `washers` is how far they have
 *     turned on it [rad], `drive` the drive's field as a part of its amplitude, −1 to 1;
 *   setPath(points, count): the line that the axis' end has drawn, a Float32Array of x, y, z [m];
 *   setSpin(sense): which way the arrow turns, 1, −1 or 0;
 *   setTheme(theme); show({path, axis, spin, drive, top, height}): what is seen, each true or false;
 *   setLean(factor): the angle of the axis from upright is drawn enlarged by the factor, up to LEAN_MOST, and so is its path;
 *   setPixel(size): lines are drawn no thinner than pixels of this size, as pixelOf returns it;
 *   axisEnd(position, quaternion): where the end of the drawn axis is then [m]; dispose(): free the graphics' memory.
 */
export function buildScene(THREE, parts, theme = "light") {
  const scale = scaleOf(parts), scene = new THREE.Scene();
  const paints = [];        // [material, key of the colours]
  const paint = (key, options = {}) => {
    const material = new THREE.MeshStandardMaterial({roughness: 0.55, metalness: 0.05, ...options});
    paints.push([material, key]);
    return material;
  };
  const plain = (key, options = {}) => {
    const material = new THREE.MeshBasicMaterial(options);
    paints.push([material, key]);
    return material;
  };

  // light from above left, a soft one from everywhere, and a little from behind, which draws the edges
  const sky = new THREE.HemisphereLight("#ffffff", "#8d8a86", 1.5);
  sky.position.set(0, 0, 1);
  const key = new THREE.DirectionalLight("#fff6e8", 2.2);
  key.position.set(-6, -8, 14);
  const behind = new THREE.DirectionalLight("#dfeaff", 0.9);
  behind.position.set(8, 10, 6);
  scene.add(sky, key, behind);

  // the ground, the base on it, and the top's shadow between them
  const {inner, outer, bottom, top: upper, edge} = parts.base;
  const ground = new THREE.Mesh(new THREE.CircleGeometry(2.1 * outer * scale, AROUND), plain("ground"));
  ground.position.z = bottom * scale - 0.02;
  const base = new THREE.Group();
  base.add(new THREE.Mesh(revolve(THREE, scale, [
    [inner + edge, bottom], [outer - edge, bottom], [outer, bottom + edge], [outer, upper - edge],
    [outer - edge, upper], [inner + edge, upper], [inner, upper - edge], [inner, bottom + edge], [inner + edge, bottom],
  ]), paint("base", {roughness: 0.42, metalness: 0.25})));
  const shade = shadowTexture(THREE);
  const shadow = new THREE.Mesh(
    new THREE.CircleGeometry(1, 48), new THREE.MeshBasicMaterial({map: shade, transparent: true, depthWrite: false}));
  shadow.position.z = bottom * scale + 0.04;
  paints.push([shadow.material, "shadow"]);
  scene.add(ground, base, shadow);

  // the top, and what turns on it
  const top = new THREE.Group(), washers = new THREE.Group();
  top.add(washers);
  const groups = {top, washers};
  for (const part of parts.parts) {
    const shiny = part.colour === "washers" ? {roughness: 0.35, metalness: 0.15} : {};
    groups[part.turns].add(new THREE.Mesh(revolve(THREE, scale, part.outline), paint(part.colour, shiny)));
  }
  for (const mark of parts.marks) {
    const geometry = revolve(THREE, scale, mark.outline, mark.azimuth - mark.width / 2, mark.width, 0.012 / scale);
    groups[mark.turns].add(new THREE.Mesh(geometry, paint(mark.colour, {side: THREE.DoubleSide, roughness: 0.8})));
  }
  scene.add(top);

  // the axis, a line through it all; the arrow of the spin, which leans with the axis and does not turn with the top
  const leaning = new THREE.Group();
  const {up, down} = parts.axis;
  const axis = new THREE.Mesh(new THREE.CylinderGeometry(AXIS, AXIS, (up + down) * scale, 8), plain("axis"));
  axis.rotation.x = Math.PI / 2;
  axis.position.z = (up - down) / 2 * scale;
  const end = new THREE.Mesh(new THREE.SphereGeometry(END, 16, 12), plain("path"));
  end.position.z = up * scale;
  const spin = spinArrow(THREE, parts.spin.radius * scale, plain("spin"));
  spin.position.z = parts.spin.height * scale;
  leaning.add(axis, end, spin);
  scene.add(leaning);

  // the line from the top straight down
  const plumb = new THREE.Mesh(new THREE.CylinderGeometry(PLUMB, PLUMB, 1, 6), plain("faint"));
  plumb.rotation.x = Math.PI / 2;
  scene.add(plumb);
  const points = parts.parts.flatMap((part) => part.outline);
  const widest = Math.max(...points.map((point) => point[0])), lowest = Math.min(...points.map((point) => point[1]));

  // the path of the axis' end: a ribbon on its edge, since lines are one pixel wide, which fades towards its beginning
  const path = new THREE.Mesh(
    new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({side: THREE.DoubleSide, transparent: true, vertexColors: true}));
  path.frustumCulled = false;
  paints.push([path.material, "path"]);
  scene.add(path);

  // the drive's field: an arrow under the top that grows and shrinks
  const drive = parts.drive ? driveArrow(THREE, parts.drive, plain("drive")) : null;
  if (drive) {
    drive.position.z = upper * scale + 0.4;
    scene.add(drive);
  }

  const height = heightScale(THREE, parts, scale, plain("faint"), plain("axis"));
  scene.add(height.group);

  const turned = new THREE.Quaternion(), more = new THREE.Quaternion(), axisNow = new THREE.Vector3();
  const upright = new THREE.Vector3(0, 0, 1), across = new THREE.Vector3();
  let lean = 1;
  /** The axis of a pose as it is drawn; `turned` is its attitude then. */
  const along = (quaternion) => {
    axisNow.set(0, 0, 1).applyQuaternion(turned.set(...quaternion));
    const tilt = Math.acos(Math.min(Math.max(axisNow.z, -1), 1)), wanted = Math.min(lean * tilt, LEAN_MOST);
    if (lean !== 1 && tilt > 1e-6 && wanted > tilt) {
      more.setFromAxisAngle(across.set(-axisNow.y, axisNow.x, 0).normalize(), wanted - tilt);
      turned.premultiply(more);
      axisNow.applyQuaternion(more);
    }
    return axisNow;
  };

  let ribbon = RIBBON;
  const view = {
    scene, top, washers, base,
    half: (up - lowest) / 2 * scale,

    /** The middle between tip and end of the axis, into a vector. */
    middle: (into) => into.set(0, 0, (up + lowest) / 2 * scale).applyQuaternion(leaning.quaternion).add(leaning.position),

    setPixel(size) {
      const radius = THINNEST / 2 * size;
      axis.scale.x = axis.scale.z = Math.max(1, radius / AXIS);
      plumb.scale.x = plumb.scale.z = Math.max(1, 0.7 * radius / PLUMB);
      end.scale.setScalar(Math.max(1, 2.5 * radius / END));
      spin.scale.z = Math.max(1, radius / (SPIN * parts.spin.radius * scale));  // seen from the side it is thinnest
      ribbon = Math.max(RIBBON, radius);
    },

    axisEnd(position, quaternion) {
      const n = along(quaternion);
      return [position[0] + up * n.x, position[1] + up * n.y, position[2] + up * n.z];
    },

    setPose(position, quaternion, {washers: slipped = 0, drive: share = 0} = {}) {
      const n = along(quaternion), aside = Math.hypot(n.x, n.y);  // a simulated fall knows no ground
      const lower = points.reduce((least, [r, z]) => Math.min(least, n.z * z - aside * r), Infinity);
      const away = Math.hypot(position[0], position[1]), floor = away > inner && away < outer ? upper : bottom;
      top.position.set(position[0] * scale, position[1] * scale, Math.max(position[2], floor - lower) * scale);
      top.quaternion.copy(turned);
      washers.rotation.z = slipped;
      leaning.position.copy(top.position);
      leaning.quaternion.setFromUnitVectors(upright, n);
      const from = floor * scale, over = Math.max(top.position.z + lowest * scale - from, 0.01);
      plumb.position.set(top.position.x, top.position.y, from + over / 2);
      plumb.scale.y = over;
      height.point(top.position.z);
      const radius = widest * scale * (1.2 + 0.04 * over);  // the higher, the softer
      shadow.position.x = top.position.x;
      shadow.position.y = top.position.y;
      shadow.scale.set(radius, radius, 1);
      if (drive) drive.setShare(share);
    },

    setPath(points, count = points.length / 3) {
      const geometry = path.geometry;
      if (!geometry.index || geometry.getAttribute("position").count < 2 * count) makeRibbon(THREE, geometry, 2 * count);
      const places = geometry.getAttribute("position"), colours = geometry.getAttribute("color");
      for (let k = 0; k < count; k += 1) {
        const x = points[3 * k] * scale, y = points[3 * k + 1] * scale, z = points[3 * k + 2] * scale, share = (k + 1) / count;
        places.setXYZ(2 * k, x, y, z - ribbon);
        places.setXYZ(2 * k + 1, x, y, z + ribbon);
        colours.setW(2 * k, share);
        colours.setW(2 * k + 1, share);
      }
      places.needsUpdate = colours.needsUpdate = true;
      geometry.setDrawRange(0, 6 * Math.max(count - 1, 0));
    },

    setSpin(sense) {
      spin.userData.there = sense !== 0;
      spin.visible = spin.userData.there && spin.userData.wanted;
      spin.scale.y = sense < 0 ? -1 : 1;
    },

    show(wanted) {
      if ("path" in wanted) path.visible = end.visible = wanted.path;
      if ("axis" in wanted) axis.visible = wanted.axis;
      if ("spin" in wanted) spin.visible = (spin.userData.wanted = wanted.spin) && spin.userData.there;
      if ("drive" in wanted && drive) drive.visible = wanted.drive;
      if ("height" in wanted) height.group.visible = wanted.height;
      if ("top" in wanted) top.visible = leaning.visible = plumb.visible = shadow.visible = wanted.top;
    },

    setLean(factor) { lean = factor; },

    setTheme(name) {
      const colours = parts.colours[name];
      scene.background = new THREE.Color(colours.background);
      for (const [material, colour] of paints) material.color.set(colours[colour]);
      height.label(colours.text);
      sky.intensity = name === "dark" ? 1.1 : 1.5;
      shadow.material.opacity = name === "dark" ? 0.75 : 0.45;
    },

    dispose() {
      scene.traverse((object) => {
        object.geometry?.dispose();
        object.material?.map?.dispose();
        object.material?.dispose();
      });
    },
  };
  spin.userData.wanted = true;
  view.setSpin(1);
  view.setTheme(theme);
  view.setPose(parts.view.floats, [0, 0, 0, 1]);
  return view;
}

/** Whether three dimensions are computed by the processor: then edges are not smoothed, which would take most of the time. */
export function drawnBySoftware() {
  const probe = document.createElement("canvas").getContext("webgl2");
  if (!probe) return true;
  const about = probe.getExtension("WEBGL_debug_renderer_info");
  const name = about ? String(probe.getParameter(about.UNMASKED_RENDERER_WEBGL)) : "";
  probe.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

/**
 * What is drawn on a canvas, with a camera that turns and comes nearer by mouse, touch and keys.
 *
 * Keys: arrows turn, + and − come nearer and go back, 0 puts the camera back.  With a close-up the top is drawn once more
 * on the right of a wide picture, large, from the side on which the camera is.
 *
 * @param {() => void} changed is called when the picture should be drawn again.
 * @param {number} ratio pixels of the picture in one of the page where the processor draws.
 * @returns {object} view (of buildScene), camera, theme(), and render(), reset(), orbit(around, up, nearer), resize(),
 *   setParts(parts), setCloseUp(wanted).
 */
export function openStage(THREE, OrbitControls, canvas, parts, {changed, ratio = 1}) {
  const soft = drawnBySoftware(), dark = matchMedia("(prefers-color-scheme: dark)");
  const theme = () => (dark.matches ? "dark" : "light");
  const renderer = new THREE.WebGLRenderer({canvas, antialias: !soft, powerPreference: "low-power"});
  renderer.setPixelRatio(soft ? ratio : Math.min(devicePixelRatio || 1, 2));
  const camera = buildCamera(THREE, parts, 1), controls = new OrbitControls(camera, canvas);
  Object.assign(controls, {enablePan: false, zoomToCursor: true, minDistance: NEAREST, maxDistance: FARTHEST, maxPolarAngle: 1.62});
  const near = new THREE.PerspectiveCamera(camera.fov, 1, 1, 400), looksAt = new THREE.Vector3(), offset = new THREE.Vector3();
  near.up.set(0, 0, 1);
  let view = buildScene(THREE, parts, theme()), placed = null, closeUp = false;
  /** The width of the close-up [pixels of the page]; 0: there is none. */
  const closeWidth = (width, height) => (closeUp && width > CLOSE_ASPECT * height ? Math.round(CLOSE_SHARE * width) : 0);

  function reset() {
    placeCamera(THREE, camera, parts, camera.aspect);
    controls.target.copy(camera.userData.target);
    controls.update();
    placed = camera.position.clone();
    changed();
  }

  function resize() {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height) return;
    const beside = closeWidth(width, height);
    renderer.setSize(width, height, false);
    controls.zoomToCursor = !beside;
    near.aspect = beside / height || 1;
    near.updateProjectionMatrix();
    camera.aspect = (width - beside) / height;
    if (!placed || camera.position.distanceTo(placed) < 1e-6) reset();  // a person has not moved it
    camera.updateProjectionMatrix();
    view.setPixel(pixelOf(camera, height * renderer.getPixelRatio()));
    changed();
  }

  /** Draw a part of the picture, from a place on its left edge on [pixels of the page]. */
  function renderPart(from, width, height, seenBy) {
    renderer.setViewport(from, 0, width, height);
    renderer.setScissor(from, 0, width, height);
    renderer.render(view.scene, seenBy);
  }

  function render() {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight], beside = closeWidth(width, height);
    renderer.setScissorTest(false);
    renderer.setClearColor(parts.colours[theme()].ground);  // of which the seam is left
    if (beside) renderer.clear();
    renderer.setScissorTest(beside > 0);
    renderPart(0, width - beside - (beside && SEAM), height, camera);
    if (!beside) return;
    const away = view.middle(offset).sub(looksAt).length();
    if (away > LEASH * view.half) looksAt.add(offset.setLength(away - LEASH * view.half));
    const distance = (1 + 2 * LEASH) * view.half / Math.tan(near.fov / 2 * TURN / 360) / Math.min(1, near.aspect);
    near.position.copy(camera.position).sub(controls.target).setLength(distance).add(looksAt);
    near.lookAt(looksAt);
    renderPart(width - beside, beside, height, near);
  }

  /** Turn the camera by angles [rad] and come nearer by a factor. */
  function orbit(around, up, nearer = 1) {
    const offset = camera.position.clone().sub(controls.target);
    const ball = new THREE.Spherical().setFromVector3(new THREE.Vector3(offset.x, offset.z, -offset.y));
    ball.theta += around;
    ball.phi = Math.min(Math.max(ball.phi - up, 0.02), controls.maxPolarAngle);
    ball.radius = Math.min(Math.max(ball.radius / nearer, NEAREST), FARTHEST);
    const moved = new THREE.Vector3().setFromSpherical(ball);
    camera.position.set(moved.x, -moved.z, moved.y).add(controls.target);
    controls.update();
    changed();
  }

  const keys = {
    ArrowLeft: () => orbit(-0.1, 0), ArrowRight: () => orbit(0.1, 0), ArrowUp: () => orbit(0, 0.08), ArrowDown: () => orbit(0, -0.08),
    "+": () => orbit(0, 0, 1.12), "=": () => orbit(0, 0, 1.12), "-": () => orbit(0, 0, 1 / 1.12), 0: reset,
  };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  controls.addEventListener("change", changed);
  dark.addEventListener("change", () => {
    view.setTheme(theme());
    changed();
  });
  new ResizeObserver(resize).observe(canvas);
  resize();

  return {
    get view() { return view; },
    camera, theme, reset, orbit, resize, render,
    setCloseUp(wanted) {
      closeUp = wanted;
      resize();
    },
    setParts(described) {
      view.dispose();
      parts = described;
      view = buildScene(THREE, parts, theme());
      placed = null;
      resize();
    },
  };
}

/** Drawn units in a metre. */
function scaleOf(parts) {
  return REACH / parts.view.reach;
}

/**
 * A camera from which the base and the whole axis are seen, and where it looks at, for OrbitControls' target.
 *
 * @param {number} aspect width over height of the picture.
 * @returns the camera, with its `userData.target` set to where it looks.
 */
export function buildCamera(THREE, parts, aspect) {
  const camera = new THREE.PerspectiveCamera(26, aspect, 1, 400);
  camera.up.set(0, 0, 1);
  placeCamera(THREE, camera, parts, aspect);
  return camera;
}

/** Put a camera back to where buildCamera has it, for a picture of this shape. */
export function placeCamera(THREE, camera, parts, aspect) {
  const {reach, top} = parts.view, bottom = parts.base.bottom, scale = scaleOf(parts);
  const target = new THREE.Vector3(0, 0, (0.48 * top + 0.52 * bottom) * scale);
  const half = Math.tan(camera.fov / 2 * TURN / 360);
  const distance = Math.max((0.62 * (top - bottom) + 0.16 * reach) / half, 1.1 * reach / (half * aspect) + reach) * scale;
  const elevation = 0.33, azimuth = -1.25;
  camera.aspect = aspect;
  camera.position.set(
    target.x + distance * Math.cos(elevation) * Math.cos(azimuth),
    target.y + distance * Math.cos(elevation) * Math.sin(azimuth),
    target.z + distance * Math.sin(elevation));
  camera.lookAt(target);
  camera.userData.target = target;
  camera.updateProjectionMatrix();
}

/** How large a pixel is at what the camera looks at, in drawn units, of a picture of this height [pixels]. */
export function pixelOf(camera, height) {
  return 2 * camera.position.distanceTo(camera.userData.target) * Math.tan(camera.fov / 2 * TURN / 360) / height;
}

/**
 * The surface that an outline of points (radius, height) [m] sweeps as it turns about z: smooth around, with its edges.
 *
 * @param {number} from, width the piece of a turn [rad]; by how much it stands `out` of the outline [m].
 */
function revolve(THREE, scale, outline, from = 0, width = TURN, out = 0) {
  const places = [], normals = [], faces = [];
  const steps = Math.max(2, Math.ceil(AROUND * width / TURN));
  for (let k = 0; k + 1 < outline.length; k += 1) {
    const [[r0, z0], [r1, z1]] = [outline[k], outline[k + 1]];
    const length = Math.hypot(r1 - r0, z1 - z0);
    if (length === 0) continue;
    const across = (z1 - z0) / length, along = -(r1 - r0) / length;  // outline runs upwards outside: outwards is right
    const first = places.length / 3;
    for (let step = 0; step <= steps; step += 1) {
      const angle = from + width * step / steps, x = Math.cos(angle), y = Math.sin(angle);
      for (const [r, z] of [[r0, z0], [r1, z1]]) {
        const radius = (r + out * across) * scale;
        places.push(radius * x, radius * y, (z + out * along) * scale);
        normals.push(across * x, across * y, along);
      }
      const here = first + 2 * step;
      if (step < steps) faces.push(here, here + 2, here + 1, here + 1, here + 2, here + 3);
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  geometry.setAttribute("normal", new THREE.Float32BufferAttribute(normals, 3));
  geometry.setIndex(faces);
  return geometry;
}

/** Make room for a ribbon through this number of points: two corners each, and two triangles from each to the next. */
function makeRibbon(THREE, geometry, points) {
  const faces = [];
  for (let k = 0; k + 1 < points; k += 1) faces.push(2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 1, 2 * k + 3, 2 * k + 2);
  geometry.setIndex(faces);
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * points), 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(8 * points).fill(1), 4));
}

/** Three quarters of a circle with a head, in the plane across the axis, counterclockwise seen from above. */
function spinArrow(THREE, radius, material) {
  const arrow = new THREE.Group();
  const length = 0.72 * TURN, thick = SPIN * radius;
  arrow.add(new THREE.Mesh(new THREE.TorusGeometry(radius, thick, 10, 64, length), material));
  const head = new THREE.Mesh(new THREE.ConeGeometry(3.4 * thick, 9 * thick, 20), material);
  head.position.set(radius * Math.cos(length), radius * Math.sin(length), 0);
  head.rotation.z = length;  // a cone points along y, which is the sense at angle 0
  arrow.add(head);
  return arrow;
}

/**
 * A post beside the base with a mark for each centimetre above its middle, and a pointer at the height of the top.
 *
 * A base of another size has marks at the power of ten that suits it.
 */
function heightScale(THREE, parts, scale, faint, dark) {
  const group = new THREE.Group(), {outer} = parts.base, {top} = parts.view;
  const step = 10 ** Math.round(Math.log10(top / 9)), x = -1.12 * outer * scale, marks = Math.round(0.85 * top / step);
  const post = new THREE.Mesh(new THREE.BoxGeometry(0.06, 0.06, marks * step * scale), faint);
  post.position.set(x, 0, marks * step * scale / 2);
  group.add(post);
  const labels = [];
  for (let k = 0; k <= marks; k += 1) {
    const long = k % 2 === 0, mark = new THREE.Mesh(new THREE.BoxGeometry(long ? 0.42 : 0.24, 0.06, 0.07), faint);
    mark.position.set(x + (long ? 0.21 : 0.12), 0, k * step * scale);
    group.add(mark);
    if (!long || !k) continue;
    const label = new THREE.Sprite(new THREE.SpriteMaterial({transparent: true, depthWrite: false}));
    label.position.set(x - 1.05, 0, k * step * scale);
    label.scale.set(2, 1, 1);
    group.add(label);
    labels.push([label, `${+(k * step * 100).toPrecision(3)}${k + 2 > marks ? " cm" : ""}`]);
  }
  const pointer = new THREE.Mesh(new THREE.ConeGeometry(0.16, 0.5, 12), dark);
  pointer.rotation.z = Math.PI / 2;
  pointer.position.x = x + 0.75;
  group.add(pointer);
  return {
    group,
    point: (z) => { pointer.position.z = z; },
    label(colour) {
      for (const [label, text] of labels) {
        const paper = document.createElement("canvas"), pen = paper.getContext("2d");
        [paper.width, paper.height] = [128, 64];
        pen.font = "40px system-ui, sans-serif";
        pen.textAlign = "right";
        pen.textBaseline = "middle";
        pen.fillStyle = colour;
        pen.fillText(text, 124, 34);
        label.material.map?.dispose();
        label.material.map = new THREE.CanvasTexture(paper);
        label.material.needsUpdate = true;
      }
    },
  };
}

/** A double line of an arrow through the base's axis, along the drive's direction. */
function driveArrow(THREE, direction, material) {
  const arrow = new THREE.Group();
  const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.06, 0.06, 1, 12), material);
  const head = new THREE.Mesh(new THREE.ConeGeometry(0.2, 0.5, 20), material);
  arrow.add(shaft, head);
  arrow.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...direction));
  arrow.setShare = (share) => {
    const length = 2.4 * share;
    shaft.scale.y = Math.max(Math.abs(length), 0.01);
    shaft.position.y = length / 2;
    head.position.y = length + 0.25 * Math.sign(share);
    head.rotation.z = share < 0 ? Math.PI : 0;
    head.scale.setScalar(Math.min(1, 0.15 + 1.2 * Math.abs(share)));
  };
  arrow.setShare(0);
  return arrow;
}

/** A dark spot that fades to its edge. */
function shadowTexture(THREE) {
  const size = 128, data = new Uint8Array(4 * size * size);
  for (let k = 0; k < size * size; k += 1) {
    const x = (k % size + 0.5) / size * 2 - 1, y = (Math.floor(k / size) + 0.5) / size * 2 - 1;
    const inside = Math.min(Math.max((1 - Math.hypot(x, y)) / 0.55, 0), 1);
    data.set([255, 255, 255, Math.round(255 * inside * inside * (3 - 2 * inside))], 4 * k);
  }
  const texture = new THREE.DataTexture(data, size, size);
  texture.needsUpdate = true;
  return texture;
}
