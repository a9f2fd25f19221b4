const stage = document.getElementById("stage");
const text = (id) => document.getElementById(id).textContent;

async function inflated(id) {
  const packed = Uint8Array.from(atob(text(id)), (c) => c.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}

/* The faces: points, normals, triangles and edge segments of each. */
function unpacked(head, data) {
  const counts = head.faces.map(([, , points, triangles, segments]) => [points, triangles, segments]);
  const [points, triangles, segments] = [0, 1, 2].map((k) => counts.reduce((sum, each) => sum + each[k], 0));
  const Whole = head.wide ? Uint32Array : Uint16Array;
  const coded = new Uint16Array(data, 0, 3 * points);
  const folded = new Int16Array(data, 6 * points, 2 * points);
  const rest = new Whole(data.slice(10 * points));
  const position = new Float32Array(3 * points), normal = new Float32Array(3 * points);
  for (let i = 0; i < points; i++) {
    for (let k = 0; k < 3; k++) position[3 * i + k] = head.low[k] + head.step[k] * coded[3 * i + k];
    let x = folded[2 * i] / 32767, y = folded[2 * i + 1] / 32767;
    const z = 1 - Math.abs(x) - Math.abs(y);
    if (z < 0) [x, y] = [(1 - Math.abs(y)) * (x < 0 ? -1 : 1), (1 - Math.abs(x)) * (y < 0 ? -1 : 1)];
    const size = Math.hypot(x, y, z);
    normal.set([x / size, y / size, z / size], 3 * i);
  }
  let point = 0, corner = 0, end = 3 * triangles;
  return counts.map(([p, t, s]) => {
    const face = {
      position: position.subarray(3 * point, 3 * (point + p)), normal: normal.subarray(3 * point, 3 * (point + p)),
      corners: rest.subarray(corner, corner + 3 * t), ends: rest.subarray(end, end + 2 * s),
    };
    point += p; corner += 3 * t; end += 2 * s;
    return face;
  });
}

/* Light and stripes as in the pictures: by the normal as the viewer sees it. */
const VERTEX = `
attribute vec4 tint; attribute float face; varying vec3 n; varying vec4 colour; flat varying float own;
void main() { n = normalMatrix * normal; colour = tint; own = face; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;
const FRAGMENT = `
uniform bool zebra, mapped; uniform float chosen; varying vec3 n; varying vec4 colour; flat varying float own;
float under(float x) { float whole = floor(x); return 0.5 * whole + min(x - whole, 0.5); }
void main() {
  vec3 m = normalize(n) * (gl_FrontFacing ? 1.0 : -1.0);
  vec3 key = normalize(vec3(-0.42, 0.58, 0.70)), between = normalize(key + vec3(0.0, 0.0, 1.0));
  vec3 base = abs(own - chosen) < 0.5 ? vec3(0.98, 0.70, 0.24) : colour.rgb;
  vec3 shown;
  if (zebra) {
    float phase = asin(clamp(m.y, -1.0, 1.0)) * 36.0 / 3.14159265, wide = clamp(fwidth(phase), 1e-4, 1e4);
    float light = (under(phase + 0.5 * wide) - under(phase - 0.5 * wide)) / wide;
    vec3 white = abs(own - chosen) < 0.5 ? base : vec3(0.97, 0.97, 0.965);
    shown = mix(vec3(0.13, 0.15, 0.18), white, light) * (0.80 + 0.20 * clamp(m.z, 0.0, 1.0));
  } else if (mapped) {
    shown = colour.rgb * (0.82 + 0.18 * clamp(m.z, 0.0, 1.0));
  } else {
    float soft = 0.46 + 0.14 * m.y + 0.34 * max(dot(key, m), 0.0) + 0.16 * max(m.z, 0.0);
    shown = base * soft * (gl_FrontFacing ? 1.0 : 0.86) + 0.10 * pow(max(dot(between, m), 0.0), 24.0);
  }
  gl_FragColor = vec4(clamp(shown, 0.0, 1.0), zebra ? 1.0 : colour.a);
}`;

function geometries(THREE, head, faces, body) {
  const own = body.faces.map((k) => faces[k]);
  const total = (name) => own.reduce((sum, face) => sum + face[name].length, 0);
  const points = total("position") / 3;
  const out = {
    position: new Float32Array(3 * points), normal: new Float32Array(3 * points), tint: new Uint8Array(4 * points),
    face: new Float32Array(points), corners: new Uint32Array(total("corners")), ends: new Uint32Array(total("ends")),
  };
  let point = 0, corner = 0, end = 0;
  own.forEach((face, i) => {
    const count = face.position.length / 3, colour = body.colours[i];
    const bytes = colour ? colour.slice(1).match(/../g).map((two) => parseInt(two, 16)) : head.clay;
    out.position.set(face.position, 3 * point);
    out.normal.set(face.normal, 3 * point);
    for (let k = point; k < point + count; k++) {
      out.tint.set([...bytes.slice(0, 3), bytes[3] ?? 255], 4 * k);
      out.face[k] = head.faces[body.faces[i]][0];
    }
    for (const k of face.corners) out.corners[corner++] = k + point;
    for (const k of face.ends) out.ends[end++] = k + point;
    point += count;
  });
  const surface = new THREE.BufferGeometry(), edges = new THREE.BufferGeometry();
  const position = new THREE.BufferAttribute(out.position, 3);
  surface.setAttribute("position", position);
  surface.setAttribute("normal", new THREE.BufferAttribute(out.normal, 3));
  surface.setAttribute("tint", new THREE.BufferAttribute(out.tint, 4, true));
  surface.setAttribute("face", new THREE.BufferAttribute(out.face, 1));
  surface.setIndex(new THREE.BufferAttribute(out.corners, 1));
  edges.setAttribute("position", position);
  edges.setIndex(new THREE.BufferAttribute(out.ends, 1));
  return { surface, edges, clear: out.tint.some((value, k) => k % 4 === 3 && value < 255) };
}

/* For each instance the geometry in the colours of deviation: triangles are divided as many times as is said. */
function shaded(THREE, head, faces, data, table) {
  const triangles = faces.map((face) => face.corners.length / 3), starts = [];
  let next = triangles.reduce((sum, count, k) => (starts[k] = sum) + count, 0);
  return head.placed.map(({ body }) => {
    const position = [], normal = [], tint = [], own = [], corners = [];
    for (const k of head.bodies[body].faces) {
      const { position: points, normal: normals, corners: of } = faces[k], first = position.length / 3;
      const put = (weights, three) => {
        for (let c = 0; c < 3; c++) {
          position.push(weights.reduce((sum, w, i) => sum + w * points[3 * three[i] + c], 0));
          normal.push(weights.reduce((sum, w, i) => sum + w * normals[3 * three[i] + c], 0));
        }
        const shade = 3 * data[next++];
        tint.push(table[shade], table[shade + 1], table[shade + 2], 255);
        own.push(head.faces[k][0]);
      };
      for (let i = 0; i < points.length / 3; i++) put([1], [i]);
      for (let t = 0; t < triangles[k]; t++) {
        const count = data[starts[k] + t], three = of.subarray(3 * t, 3 * t + 3);
        if (count === 1) {
          corners.push(first + three[0], first + three[1], first + three[2]);
          continue;
        }
        let at = position.length / 3;
        for (let i = 0; i <= count; i++) {
          const row = count + 1 - i;
          for (let j = 0; j < row; j++) {
            put([(count - i - j) / count, i / count, j / count], three);
            if (j + 1 < row) corners.push(at + j, at + row + j, at + j + 1);
            if (j + 2 < row) corners.push(at + row + j, at + row + j + 1, at + j + 1);
          }
          at += row;
        }
      }
    }
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.Float32BufferAttribute(position, 3));
    made.setAttribute("normal", new THREE.Float32BufferAttribute(normal, 3));
    made.setAttribute("tint", new THREE.BufferAttribute(new Uint8Array(tint), 4, true));
    made.setAttribute("face", new THREE.Float32BufferAttribute(own, 1));
    made.setIndex(corners);
    return made;
  });
}

async function begin() {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("webgl2", { antialias: true });
  if (!context) return;
  const source = URL.createObjectURL(new Blob([await inflated("three")], { type: "text/javascript" }));
  const THREE = await import(source);
  URL.revokeObjectURL(source);
  const head = JSON.parse(text("head"));
  const faces = unpacked(head, await inflated("mesh"));
  const renderer = new THREE.WebGLRenderer({ canvas, context });
  renderer.setClearColor(0xffffff, 1);
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
  const uniforms = { zebra: { value: false }, mapped: { value: false }, chosen: { value: -1 } };
  const shade = { uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
  const solid = new THREE.ShaderMaterial(shade);
  const glass = new THREE.ShaderMaterial({ ...shade, transparent: true });
  const ink = new THREE.LineBasicMaterial({ color: 0x2b3138 });
  const scene = new THREE.Scene(), surfaces = [], edges = [];
  const bodies = head.bodies.map((body) => geometries(THREE, head, faces, body));
  for (const { body, frame } of head.placed) {
    const matrix = new THREE.Matrix4().fromArray(frame);
    const own = [new THREE.Mesh(bodies[body].surface, bodies[body].clear ? glass : solid), new THREE.LineSegments(bodies[body].edges, ink)];
    for (const each of own) {
      each.matrixAutoUpdate = false;
      each.matrix.copy(matrix);
      scene.add(each);
    }
    surfaces.push(own[0]);
    edges.push(own[1]);
  }

  const [low, high] = head.box.map((each) => new THREE.Vector3(...each));
  const middle = low.clone().add(high).multiplyScalar(0.5), radius = low.distanceTo(high) / 2 || 1;
  const camera = new THREE.OrthographicCamera();
  const eye = { turn: 0, rise: 0, zoom: 1, target: middle.clone(), spread: [radius, radius] };
  const axes = () => { /* to the right, up, and towards the viewer */
    const toward = new THREE.Vector3(Math.cos(eye.rise) * Math.cos(eye.turn), Math.cos(eye.rise) * Math.sin(eye.turn), Math.sin(eye.rise));
    const right = new THREE.Vector3(-Math.sin(eye.turn), Math.cos(eye.turn), 0);
    return [right, new THREE.Vector3().crossVectors(toward, right), toward];
  };
  const frame = () => {
    const { clientWidth: w, clientHeight: h } = canvas;
    if (!w || !h) return;
    if (canvas.width !== Math.round(w * devicePixelRatio) || canvas.height !== Math.round(h * devicePixelRatio)) {
      renderer.setPixelRatio(devicePixelRatio);
      renderer.setSize(w, h, false);
    }
    const [right, up, toward] = axes();
    camera.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(right, up, toward));
    camera.position.copy(eye.target).addScaledVector(toward, 4 * radius);
    const half = 1.08 * Math.max(eye.spread[0] / w, eye.spread[1] / h) / eye.zoom;
    Object.assign(camera, { left: -half * w, right: half * w, top: half * h, bottom: -half * h, near: 0.5 * radius, far: 7.5 * radius });
    camera.updateProjectionMatrix();
    renderer.render(scene, camera);
  };
  let waiting = false;
  const draw = () => {
    if (!waiting) requestAnimationFrame(() => { waiting = false; frame(); });
    waiting = true;
  };
  const extent = (way) => { /* how far the model reaches along a direction */
    let least = Infinity, most = -Infinity;
    for (const { geometry, matrix: { elements: m } } of surfaces) {
      const [x, y, z, shift] = [0, 4, 8, 12].map((k) => way.x * m[k] + way.y * m[k + 1] + way.z * m[k + 2]);
      const points = geometry.attributes.position.array;
      for (let k = 0; k < points.length; k += 3) {
        const at = x * points[k] + y * points[k + 1] + z * points[k + 2] + shift;
        least = Math.min(least, at);
        most = Math.max(most, at);
      }
    }
    return [least, most];
  };
  const look = (x, y, z) => {
    eye.turn = x || y ? Math.atan2(y, x) : -Math.PI / 2;
    eye.rise = Math.atan2(z, Math.hypot(x, y));
    eye.zoom = 1;
    const ways = axes().slice(0, 2), ends = ways.map(extent);
    eye.spread = ends.map(([least, most]) => (most - least) / 2);
    eye.target.copy(middle);
    ways.forEach((way, k) => eye.target.addScaledVector(way, (ends[k][0] + ends[k][1]) / 2 - way.dot(middle)));
    draw();
  };
  const shift = (dx, dy) => { /* pixels to the right and down */
    const perPixel = (camera.right - camera.left) / canvas.clientWidth;
    eye.target.addScaledVector(new THREE.Vector3(1, 0, 0).applyQuaternion(camera.quaternion), -dx * perPixel);
    eye.target.addScaledVector(new THREE.Vector3(0, 1, 0).applyQuaternion(camera.quaternion), dy * perPixel);
  };

  const told = stage.querySelector("output"), names = new Map(head.faces.map(([number, name]) => [number, name]));
  const rows = new Map([...document.querySelectorAll("#faces tbody tr")].map((row) => [Number(row.cells[0].dataset.v), row]));
  const choose = (number) => {
    for (const row of rows.values()) row.classList.remove("chosen");
    rows.get(number)?.classList.add("chosen");
    uniforms.chosen.value = number ?? -1;
    told.textContent = number ? `#${number} ${names.get(number) ?? ""}` : "";
    draw();
  };
  for (const [number, row] of rows) row.addEventListener("click", () => choose(number));
  const pick = (event) => {
    const box = canvas.getBoundingClientRect(), ray = new THREE.Raycaster();
    const at = new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
    ray.setFromCamera(at, camera);
    const hit = ray.intersectObjects(surfaces, false)[0];
    choose(hit && hit.object.geometry.attributes.face.getX(hit.face.a));
  };

  let held = null;
  canvas.addEventListener("pointerdown", (event) => {
    held = { x: event.clientX, y: event.clientY, moved: 0, shift: event.button !== 0 || event.shiftKey };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return;
    const dx = event.clientX - held.x, dy = event.clientY - held.y;
    Object.assign(held, { x: event.clientX, y: event.clientY, moved: held.moved + Math.abs(dx) + Math.abs(dy) });
    if (held.shift) {
      shift(dx, dy);
    } else {
      eye.turn -= 0.008 * dx;
      eye.rise = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, eye.rise + 0.008 * dy));
    }
    draw();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (held && held.moved < 4) pick(event);
    held = null;
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const box = canvas.getBoundingClientRect(), old = eye.zoom;
    eye.zoom = Math.max(0.2, Math.min(200, eye.zoom * Math.exp(-0.0015 * event.deltaY)));
    const keep = 1 - eye.zoom / old; /* what is under the pointer stays there */
    shift(keep * (event.clientX - box.left - box.width / 2) * old / eye.zoom, keep * (event.clientY - box.top - box.height / 2) * old / eye.zoom);
    draw();
  }, { passive: false });
  canvas.addEventListener("dblclick", () => look(1, -1, 1));
  for (const button of stage.querySelectorAll("[data-view]")) button.addEventListener("click", () => look(...button.dataset.view.split(",").map(Number)));
  const shows = [...stage.querySelectorAll("[data-show]")], bar = stage.querySelector(".bar");
  const plain = surfaces.map((each) => each.geometry);
  let coloured = null;
  for (const button of shows) {
    button.addEventListener("click", async () => {
      const show = button.dataset.show;
      if (show === "deviation" && !coloured) {
        const table = Uint8Array.from(atob(JSON.parse(text("table")).table), (c) => c.charCodeAt(0));
        coloured = shaded(THREE, head, faces, new Uint8Array(await inflated("shades")), table);
      }
      for (const each of shows) each.setAttribute("aria-pressed", String(each === button));
      uniforms.zebra.value = show === "zebra";
      uniforms.mapped.value = show === "deviation";
      surfaces.forEach((each, k) => { each.geometry = (show === "deviation" ? coloured : plain)[k]; });
      if (bar) bar.hidden = show !== "deviation";
      draw();
    });
  }
  stage.querySelector("[data-edges]").addEventListener("click", (event) => {
    const seen = event.target.getAttribute("aria-pressed") !== "true";
    event.target.setAttribute("aria-pressed", String(seen));
    for (const each of edges) each.visible = seen;
    draw();
  });

  canvas.setAttribute("aria-label", "The model, to turn");
  stage.querySelector(".tools").after(canvas);
  stage.querySelector(".tools").hidden = false;
  stage.classList.add("live");
  new ResizeObserver(draw).observe(canvas);
  look(1, -1, 1);
}

await begin();
