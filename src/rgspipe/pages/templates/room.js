"use strict";
// The room, its lamps and cameras, turned by hand. Surfels are rectangles, drawn from far to near; those that look away
// from the viewer are left out, so that one looks into closed rooms. Lamps and cameras are drawn over them.
for (const box of document.querySelectorAll(".room")) {
  const data = JSON.parse(box.querySelector("script").textContent);
  const canvas = box.querySelector("canvas"), said = box.querySelector("output");
  const [fits, target] = box.querySelectorAll("select");
  const unpacked = (text, kind) => new kind(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const { count, step, places, sides, colours } = data.surfels;
  const P = unpacked(places, Uint16Array), S = unpacked(sides, Int16Array), C = unpacked(colours, Uint8Array);
  const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const size = Math.max(...data.high.map((v, i) => v - data.low[i]));
  const middle = data.high.map((v, i) => (v + data.low[i]) / 2);
  const start = { around: -1.15, above: 0.5, near: 1 };
  let view = { ...start }, printing = false, spots = [], chosen = null;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const ink = () => (dark.matches && !printing ? "#e4e8ec" : "#1d2126");
  const eye = () => ({ a: Math.cos(view.around), b: Math.sin(view.around), c: Math.cos(view.above), s: Math.sin(view.above) });

  // Where a place is drawn: x to the right, y down, and how far it is from the viewer, in scene sizes.
  const projector = () => {
    const { a, b, c, s } = eye(), away = 2.6, scale = (0.95 * away * Math.min(canvas.width, canvas.height) * view.near) / 1.75;
    return ([x, y, z]) => {
      const [u, v, w] = [(x - middle[0]) / size, (y - middle[1]) / size, (z - middle[2]) / size];
      const right = -b * u + a * v, back = a * u + b * v;
      const far = away - c * back - s * w, up = c * w - s * back, zoom = scale / Math.max(far, 0.2);
      return [canvas.width / 2 + right * zoom, canvas.height / 2 - up * zoom, far];
    };
  };
  const viewer = () => { const { a, b, c, s } = eye(); return [middle[0] + 2.6 * size * a * c, middle[1] + 2.6 * size * b * c, middle[2] + 2.6 * size * s]; };

  const surfels = (pen, at) => {
    const from = viewer(), shown = [];
    for (let i = 0; i < count; i++) {
      const [u, v] = [0, 3].map((first) => [0, 1, 2].map((k) => step * S[6 * i + first + k])), n = cross(u, v);
      const p = [0, 1, 2].map((k) => data.low[k] + step * P[3 * i + k]), to = p.map((q, k) => from[k] - q);
      const facing = (n[0] * to[0] + n[1] * to[1] + n[2] * to[2]) / (Math.hypot(...to) * Math.hypot(...n));
      if (facing > 0) shown.push({ i, p, u, v, facing, far: at(p)[2] });
    }
    shown.sort((one, other) => other.far - one.far);
    for (const { i, p, u, v, facing } of shown) {
      const light = 0.55 + 0.45 * facing;
      pen.fillStyle = `rgb(${C.slice(3 * i, 3 * i + 3).map((c) => c * light).join(",")})`;
      path(pen, [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([j, k]) => at(p.map((q, m) => q + j * u[m] + k * v[m]))));
      pen.fill();
    }
  };
  const path = (pen, points) => { pen.beginPath(); points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y))); pen.closePath(); };

  const camera = (pen, at, { origin, direction, angle }) => {
    const reach = 0.16 * size, half = reach * Math.tan(angle / 2), flat = Math.hypot(direction[0], direction[1]);
    const r = flat > 1e-6 ? [direction[1] / flat, -direction[0] / flat, 0] : [1, 0, 0], d = direction;
    const u = cross(r, d);
    const corners = [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([j, k]) => at(origin.map((o, m) => o + reach * d[m] + half * (j * r[m] + k * u[m]))));
    const tip = at(origin);
    pen.strokeStyle = ink();
    path(pen, corners); pen.stroke();
    for (const corner of corners) { path(pen, [tip, corner]); pen.stroke(); }
  };

  // Classes are told by shape and colour.
  const shape = (pen, kind, [x, y], r) => {
    const turns = { out_of_frame: [4, Math.PI / 4], occluded: [3, -Math.PI / 2], around_corner: [3, Math.PI / 2] };
    if (kind === "visible") { pen.beginPath(); pen.arc(x, y, r, 0, 7); return; }
    const [corners, first] = turns[kind] ?? [4, 0];
    path(pen, Array.from({ length: corners }, (_, i) => [x + 1.25 * r * Math.cos(first + (2 * Math.PI * i) / corners), y + 1.25 * r * Math.sin(first + (2 * Math.PI * i) / corners)]));
  };
  const region = (pen, at, light) => {
    for (const [u, v] of [[0, 1], [1, 2], [2, 0]]) {
      path(pen, Array.from({ length: 40 }, (_, i) => at(light.found.map((p, k) => p + Math.cos((Math.PI * i) / 20) * light.region[u][k] + Math.sin((Math.PI * i) / 20) * light.region[v][k]))));
      pen.globalAlpha = 0.13; pen.fill(); pen.globalAlpha = 0.6; pen.stroke(); pen.globalAlpha = 1;
    }
  };
  const lamp = (pen, at, light) => {
    const scale = canvas.width / canvas.clientWidth || 1, onDark = dark.matches && !printing;
    const page = onDark ? "#13171b" : "#fff", tint = onDark ? `color-mix(in srgb, ${light.colour} 60%, white)` : light.colour;
    pen.strokeStyle = pen.fillStyle = tint; pen.lineWidth = 1.2 * scale;
    if (shown("regions") && light.region && light.found) region(pen, at, light);
    const found = light.found && at(light.found), truth = light.truth && at(light.truth);
    if (found && truth) { pen.lineWidth = 2 * scale; path(pen, [found, truth]); pen.stroke(); }
    if (truth) {
      const r = 5 * scale;
      for (const [colour, width] of [[page, 4.5], [tint, 2]]) {
        pen.strokeStyle = colour; pen.lineWidth = width * scale;
        for (const s of [1, -1]) { path(pen, [[truth[0] - r, truth[1] - s * r], [truth[0] + r, truth[1] + s * r]]); pen.stroke(); }
      }
    }
    if (!found) return;
    shape(pen, light.class, found, 5.5 * scale);
    pen.fillStyle = tint; pen.fill(); pen.strokeStyle = page; pen.lineWidth = 1.5 * scale; pen.stroke();
    spots.push({ x: found[0] / scale, y: found[1] / scale, light, told: light.told });
  };

  // What a fit weighed against its answer.
  const other = (pen, at, light, { places, told, ruled_out }) => {
    const scale = canvas.width / canvas.clientWidth || 1, r = 3.5 * scale;
    for (const place of places) {
      const [x, y] = at(place);
      pen.fillStyle = ruled_out ? "#8a8f98" : "#d0343c"; pen.strokeStyle = ink(); pen.lineWidth = scale;
      pen.fillRect(x - r, y - r, 2 * r, 2 * r); pen.strokeRect(x - r, y - r, 2 * r, 2 * r);
      spots.push({ x: x / scale, y: y / scale, light, told: `${ruled_out ? "ruled out" : "not ruled out"}: ${told}` });
    }
  };
  const shown = (kind) => box.querySelector(`input[data-kind=${kind}]`).checked;

  const draw = () => {
    const scale = devicePixelRatio || 1;
    canvas.width = canvas.clientWidth * scale; canvas.height = canvas.clientHeight * scale;
    const pen = canvas.getContext("2d"), at = projector();
    spots = [];
    surfels(pen, at);
    pen.lineWidth = 1.2 * scale;
    for (const one of data.cameras) camera(pen, at, one);
    for (const light of data.captured) lamp(pen, at, light);
    for (const light of lamps()) if (!target.value || light.target === target.value) {
      if (target.value && shown("others")) for (const one of light.others) other(pen, at, light, one);
      lamp(pen, at, light);
    }
  };
  const lamps = () => data.groups[fits.value]?.lights ?? [];
  const error = (light) => (light.error ? `${light.error} of the scene from the truth` : "truth not known");
  const say = (light, told) => { said.textContent = light ? `${light.target}, ${light.label}: ${told ?? error(light)}` : "\u00a0"; };
  const fill = () => {
    const names = [...new Set(lamps().map((light) => light.target))];
    target.replaceChildren(new Option(names.length > 1 ? `all ${names.length} targets` : "the target", ""), ...names.map((name) => new Option(name, name)));
  };
  let waiting = 0;
  const soon = () => { cancelAnimationFrame(waiting); waiting = requestAnimationFrame(draw); };
  const turn = (across, up) => { view.around -= across; view.above = Math.min(1.57, Math.max(-1.57, view.above + up)); soon(); };
  const zoom = (factor) => { view.near = Math.min(8, Math.max(0.4, view.near * factor)); soon(); };
  const acts = {
    ArrowLeft: () => turn(-0.12, 0), ArrowRight: () => turn(0.12, 0), ArrowUp: () => turn(0, 0.12), ArrowDown: () => turn(0, -0.12),
    "+": () => zoom(1.2), "-": () => zoom(1 / 1.2), Home: () => { view = { ...start }; soon(); }, t: () => { view.above = 1.57; soon(); },
  };
  canvas.addEventListener("keydown", (event) => { if (acts[event.key]) { acts[event.key](); event.preventDefault(); } });
  box.querySelectorAll("button").forEach((button) => button.addEventListener("click", () => acts[button.dataset.key]()));
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); canvas.classList.add("turning"); });
  canvas.addEventListener("pointerup", () => canvas.classList.remove("turning"));
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) turn(event.movementX / 140, event.movementY / 140);
    const near = (spot) => Math.hypot(spot.x - event.offsetX, spot.y - event.offsetY);
    const found = spots.filter((spot) => near(spot) < 14).sort((one, other) => near(one) - near(other))[0] ?? null;
    if (found !== chosen) { chosen = found; say(found?.light, found?.told); }
  });
  canvas.addEventListener("wheel", (event) => { if (event.ctrlKey) { zoom(Math.exp(-event.deltaY / 300)); event.preventDefault(); } }, { passive: false });
  fits.replaceChildren(...data.groups.map((group, i) => new Option(`${group.method}, ${group.views} view${group.views === 1 ? "" : "s"}`, i)));
  fits.addEventListener("change", () => { fill(); say(null); soon(); });
  box.querySelectorAll("input").forEach((input) => input.addEventListener("change", soon));
  target.addEventListener("change", () => { say(lamps().find((light) => light.target === target.value)); soon(); });
  dark.addEventListener("change", soon);
  addEventListener("beforeprint", () => { printing = true; draw(); });
  addEventListener("afterprint", () => { printing = false; draw(); });
  new ResizeObserver(soon).observe(canvas);
  fill();
}
