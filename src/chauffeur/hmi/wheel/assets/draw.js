/* The road and the cars on a canvas. World metres; y grows to the right of +x. Two views: from above and from behind. */
'use strict';

const SIGHT_M = 230;
const BEHIND_M = 60;
const CAMERA = { back: 15, height: 9, near: 1.5 };
const INSET = { share: 0.19, least: 96, most: 150, ahead: 100, behind: 55 };

/* A polyline of the world with width, as the outline of an area. */
function strip(points, width) {
  const left = [];
  const right = [];
  for (let i = 0; i < points.length; i += 2) {
    const a = Math.max(0, i - 2);
    const b = Math.min(points.length - 2, i + 2);
    const dx = points[b] - points[a];
    const dy = points[b + 1] - points[a + 1];
    const length = Math.hypot(dx, dy) || 1;
    const nx = (-dy / length) * width / 2;
    const ny = (dx / length) * width / 2;
    left.push([points[i] - nx, points[i + 1] - ny]);
    right.push([points[i] + nx, points[i + 1] + ny]);
  }
  return left.concat(right.reverse());
}

/* The dashes of a polyline, each with where it lies, so that those out of sight cost nothing. */
function dashes(points, on, off) {
  const pieces = [];
  let piece = null;
  let phase = 0;
  for (let i = 0; i + 3 < points.length; i += 2) {
    const [x0, y0, x1, y1] = points.slice(i, i + 4);
    const length = Math.hypot(x1 - x0, y1 - y0);
    let s = 0;
    while (s < length - 1e-9) {
      const painting = phase < on;
      const ahead = Math.min(length - s, (painting ? on : on + off) - phase);
      if (painting) {
        if (!piece) piece = [x0 + ((x1 - x0) * s) / length, y0 + ((y1 - y0) * s) / length];
        piece.push(x0 + ((x1 - x0) * (s + ahead)) / length, y0 + ((y1 - y0) * (s + ahead)) / length);
      }
      s += ahead;
      phase += ahead;
      if (painting && phase >= on - 1e-9) { pieces.push(piece); piece = null; }
      if (phase >= on + off - 1e-9) phase = 0;
    }
  }
  if (piece) pieces.push(piece);
  return pieces;
}

function makeRoad(canvas) {
  const ctx = canvas.getContext('2d');
  const view = { width: 0, height: 0, mode: 'above', scale: 6, x: 0, y: 0, cos: 1, sin: 0, h: 0, set: false, middle: 0, covered: 0, shift: 0, left: 0, right: 0, flat: true };
  let colour = {};
  let road = null;
  let areas = null;

  function resize() {
    const ratio = window.devicePixelRatio || 1;
    view.width = canvas.clientWidth;
    view.height = canvas.clientHeight;
    canvas.width = Math.round(view.width * ratio);
    canvas.height = Math.round(view.height * ratio);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    const style = getComputedStyle(document.documentElement);
    const names = ['ground', 'tuft', 'verge', 'asphalt', 'asphalt-edge', 'mark', 'centre', 'hatch', 'car', 'car-edge', 'car-side',
      'ego-fill', 'ego-edge', 'ego-side', 'sky', 'sky-low', 'label-back', 'label-ink', 'bad', 'sans'];
    colour = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    outline();
  }

  /* The whole canvas in the chosen view. */
  function whole() {
    view.flat = view.mode === 'above';
    view.left = 0;
    view.right = view.width - (view.flat ? 0 : insetWidth());
    view.middle = (view.right + view.shift) / 2;
    // 85 m ahead: so far away stands the stop sign at the start of a crossing.
    view.scale = Math.max(4.5, view.height / (road.turns ? 122 : 100));
    view.ego = view.height * (road.turns ? 0.7 : 0.76);
    view.focal = view.height * 0.98;
    view.horizon = view.height * 0.16;
  }

  const insetWidth = () => Math.min(Math.max(view.width * INSET.share, INSET.least), INSET.most);

  /* A strip on the right that shows from above what the view from behind cannot: who comes up from the rear. */
  function inset() {
    view.left = view.width - insetWidth();
    view.right = view.width;
    view.middle = (view.left + view.right) / 2;
    view.flat = true;
    view.scale = view.height / (INSET.ahead + INSET.behind);
    view.ego = INSET.ahead * view.scale;
  }

  function outline() {
    if (!road) return;
    const line = 0.24;
    areas = {
      verge: road.surfaces.map((s) => strip(s.p, s.w + 3)),
      edge: road.surfaces.map((s) => strip(s.p, s.w + 0.8)),
      asphalt: road.surfaces.map((s) => strip(s.p, s.w + 0.06)),
      solid: road.lines.filter((l) => l.s === 'solid').map((l) => strip(l.p, line)),
      centre: road.lines.filter((l) => l.s === 'centre').map((l) => strip(l.p, line)),
      dashed: road.lines.filter((l) => l.s === 'dashed').flatMap((l) => dashes(l.p, 3, 6)).map((p) => strip(p, line)),
      hatch: road.surfaces.filter((s) => s.e).flatMap(hatching),
      stop: road.signs.map((s) => strip(s.line, 0.5)),
    };
  }

  /* Diagonals across an emergency lane. */
  function hatching(surface) {
    const half = surface.w / 2 - 0.3;
    const stripes = [];
    for (let i = 0; i + 3 < surface.p.length; i += 2) {
      const [x0, y0, x1, y1] = surface.p.slice(i, i + 4);
      const length = Math.hypot(x1 - x0, y1 - y0);
      const ux = (x1 - x0) / length;
      const uy = (y1 - y0) / length;
      for (let s = 2; s < length; s += 6) {
        const x = x0 + ux * s;
        const y = y0 + uy * s;
        stripes.push(strip([x + uy * half, y - ux * half, x + ux * 3 - uy * half, y + uy * 3 + ux * half], 0.22));
      }
    }
    return stripes;
  }

  function setRoad(next) {
    road = next;
    view.set = false;
    resize();
  }

  /* World to (metres ahead, metres to the right) of the camera's ground point, and from there to pixels. */
  const ahead = (x, y) => (x - view.x) * view.cos + (y - view.y) * view.sin;
  const aside = (x, y) => -(x - view.x) * view.sin + (y - view.y) * view.cos;
  function pixel(f, r, z = 0) {
    if (view.flat) return [view.middle + r * view.scale, view.ego - f * view.scale];
    const depth = f + CAMERA.back;
    return [view.middle + (view.focal * r) / depth, view.horizon + (view.focal * (CAMERA.height - z)) / depth];
  }
  const metre = (f) => (view.flat ? view.scale : view.focal / (f + CAMERA.back));

  /* Cut an outline, given as (f, r) pairs, to what lies before the camera. */
  function clip(points) {
    const from = view.flat ? -BEHIND_M : CAMERA.near - CAMERA.back;
    const cut = [];
    for (let i = 0; i < points.length; i += 1) {
      const a = points[i];
      const b = points[(i + 1) % points.length];
      if (a[0] >= from) cut.push(a);
      if ((a[0] >= from) !== (b[0] >= from)) {
        const share = (from - a[0]) / (b[0] - a[0]);
        cut.push([from, a[1] + (b[1] - a[1]) * share]);
      }
    }
    return cut;
  }

  function fill(outlines, style) {
    ctx.fillStyle = style;
    ctx.beginPath();
    for (const outline of outlines) {
      let nearest = Infinity;
      let farthest = -Infinity;
      const local = outline.map(([x, y]) => {
        const f = ahead(x, y);
        nearest = Math.min(nearest, f);
        farthest = Math.max(farthest, f);
        return [f, aside(x, y)];
      });
      if (nearest > SIGHT_M * 3 || farthest < -BEHIND_M) continue;
      const seen = clip(local);
      if (seen.length < 3) continue;
      seen.forEach(([f, r], i) => ctx[i ? 'lineTo' : 'moveTo'](...pixel(f, r)));
      ctx.closePath();
    }
    ctx.fill('nonzero');
  }

  /* Tufts on a fixed grid of the world: without them, speed cannot be seen beside an empty road. */
  function drawGround() {
    ctx.fillStyle = colour.ground;
    ctx.fillRect(0, 0, view.width, view.height);
    ctx.fillStyle = colour.tuft;
    const reach = view.flat ? Math.max(view.width, view.height) / view.scale : 150;
    const grid = 12;
    for (let gx = Math.floor((view.x - reach) / grid); gx <= (view.x + reach) / grid; gx += 1) {
      for (let gy = Math.floor((view.y - reach) / grid); gy <= (view.y + reach) / grid; gy += 1) {
        const hash = Math.abs(Math.sin(gx * 127.1 + gy * 311.7) * 43758.5453) % 1;
        const x = (gx + hash) * grid;
        const y = (gy + ((hash * 7) % 1)) * grid;
        const f = ahead(x, y);
        if (f < (view.flat ? -BEHIND_M : 2 - CAMERA.back)) continue;
        const [px, py] = pixel(f, aside(x, y));
        if (px < view.left - 20 || px > view.right + 20 || py < -20 || py > view.height + 20) continue;
        const size = (0.5 + hash * 0.9) * metre(f);
        ctx.beginPath();
        ctx.ellipse(px, py, size, view.flat ? size : size * 0.35, 0, 0, 7);
        ctx.fill();
      }
    }
  }

  function drawSky() {
    if (view.flat) return;
    const sky = ctx.createLinearGradient(0, 0, 0, view.horizon + 14);
    sky.addColorStop(0, colour.sky);
    sky.addColorStop(0.8, colour['sky-low']);
    sky.addColorStop(1, colour.ground);
    ctx.fillStyle = sky;
    ctx.fillRect(0, 0, view.width, view.horizon + 14);
  }

  function drawSigns() {
    for (const sign of road.signs) {
      const f = ahead(...sign.post);
      if (f < CAMERA.near - CAMERA.back) continue;
      const foot = pixel(f, aside(...sign.post));
      const size = view.flat ? Math.max(12, 1.7 * view.scale) : Math.max(3, 0.6 * metre(f));
      const [x, y] = view.flat ? foot : pixel(f, aside(...sign.post), 2.4);
      if (!view.flat) {
        ctx.strokeStyle = colour['car-edge'];
        ctx.lineWidth = Math.max(1, 0.1 * metre(f));
        ctx.beginPath();
        ctx.moveTo(...foot);
        ctx.lineTo(x, y);
        ctx.stroke();
      }
      ctx.beginPath();
      for (let k = 0; k < 8; k += 1) ctx.lineTo(x + size * Math.cos(Math.PI / 8 + (k * Math.PI) / 4), y + size * Math.sin(Math.PI / 8 + (k * Math.PI) / 4));
      ctx.closePath();
      ctx.fillStyle = '#b3201a';
      ctx.fill();
      ctx.strokeStyle = '#ffffff';
      ctx.lineWidth = 1.5;
      ctx.stroke();
      if (size > 8) write('STOP', x, y + 0.5, size * 0.62, '#ffffff', 700);
    }
  }

  function write(words, x, y, size, style, weight = 600, align = 'center') {
    ctx.font = `${weight} ${size}px ${colour.sans}`;
    ctx.textAlign = align;
    ctx.textBaseline = 'middle';
    ctx.fillStyle = style;
    ctx.fillText(words, x, y);
  }

  /* body: {x, y, h, l, w, v, crashed}. */
  function drawBody(body, mine, braking) {
    const fillStyle = body.crashed ? colour.bad : mine ? colour['ego-fill'] : body.obstacle ? '#c9452f' : colour.car;
    const edge = mine ? colour['ego-edge'] : colour['car-edge'];
    if (view.flat) drawFlat(body, fillStyle, edge, mine, braking);
    else drawBox(body, fillStyle, mine ? colour['ego-side'] : body.obstacle ? '#8f2c1b' : colour['car-side'], edge, braking);
  }

  function drawFlat(body, fillStyle, edge, mine, braking) {
    const [x, y] = pixel(ahead(body.x, body.y), aside(body.x, body.y));
    const l = body.l * view.scale;
    const w = body.w * view.scale;
    if (x < view.left - l || x > view.right + l || y < -l || y > view.height + l) return;
    ctx.save();
    ctx.translate(x, y);
    ctx.rotate(body.h - view.h - Math.PI / 2);
    if (mine) {
      ctx.shadowColor = colour['ego-fill'];
      ctx.shadowBlur = 14;
    }
    ctx.beginPath();
    ctx.roundRect(-l / 2, -w / 2, l, w, Math.min(w * 0.3, l * 0.2));
    ctx.fillStyle = fillStyle;
    ctx.fill();
    ctx.shadowBlur = 0;
    ctx.lineWidth = 1.25;
    ctx.strokeStyle = edge;
    ctx.stroke();
    if (!body.obstacle) {
      ctx.fillStyle = edge;
      ctx.globalAlpha = 0.62;
      ctx.beginPath();
      ctx.roundRect(l * 0.08, -w * 0.37, l * 0.17, w * 0.74, w * 0.1);
      ctx.roundRect(-l * 0.36, -w * 0.34, l * 0.09, w * 0.68, w * 0.08);
      ctx.fill();
      ctx.globalAlpha = 1;
    }
    if (braking) {
      ctx.fillStyle = '#ff3b2f';
      ctx.fillRect(-l / 2 - 1, -w * 0.46, Math.max(2.5, l * 0.08), w * 0.3);
      ctx.fillRect(-l / 2 - 1, w * 0.16, Math.max(2.5, l * 0.08), w * 0.3);
    }
    ctx.restore();
  }

  function drawBox(body, top, side, edge, braking) {
    const f0 = ahead(body.x, body.y);
    if (f0 > SIGHT_M || f0 - body.l < CAMERA.near - CAMERA.back) return;
    const turn = body.h - view.h;
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    const r0 = aside(body.x, body.y);
    const at = (a, b, z) => pixel(f0 + a * c - b * s, r0 + a * s + b * c, z);
    const area = (points, style, stroke = true) => {
      ctx.beginPath();
      points.forEach((p, i) => ctx[i ? 'lineTo' : 'moveTo'](...p));
      ctx.closePath();
      ctx.fillStyle = style;
      ctx.fill();
      if (stroke) { ctx.strokeStyle = edge; ctx.lineWidth = Math.max(0.5, 0.03 * metre(f0)); ctx.stroke(); }
    };
    const [l, w] = [body.l / 2, body.w / 2];
    const [low, high] = [0.3, body.obstacle ? 1.2 : 0.95];
    area([at(l, -w - 0.15, 0), at(l, w + 0.15, 0), at(-l - 0.1, w + 0.15, 0), at(-l - 0.1, -w - 0.15, 0)], '#0005', false);
    const sides = [[[l, -w], [l, w]], [[l, w], [-l, w]], [[-l, w], [-l, -w]], [[-l, -w], [l, -w]]];
    const far = ([a, b]) => f0 + a * c - b * s;
    sides.sort((p, q) => far(q[0]) + far(q[1]) - far(p[0]) - far(p[1]));
    for (const [p, q] of sides) area([at(...p, low), at(...q, low), at(...q, high), at(...p, high)], side);
    area([at(l, -w, high), at(l, w, high), at(-l, w, high), at(-l, -w, high)], top);
    if (body.obstacle) return;
    const [cab, roof] = [w * 0.82, 1.45];
    const glass = [[[l * 0.35, -w * 0.9], [l * 0.35, w * 0.9], [l * 0.05, cab], [l * 0.05, -cab]], [[-l * 0.85, -w * 0.9], [-l * 0.85, w * 0.9], [-l * 0.6, cab], [-l * 0.6, -cab]]];
    for (const [a, b, d, e] of glass) area([at(...a, high), at(...b, high), at(...d, roof), at(...e, roof)], edge, false);
    for (const k of [-1, 1]) area([at(l * 0.35, k * w * 0.9, high), at(l * 0.05, k * cab, roof), at(-l * 0.6, k * cab, roof), at(-l * 0.85, k * w * 0.9, high)], edge, false);
    area([at(l * 0.05, -cab, roof), at(l * 0.05, cab, roof), at(-l * 0.6, cab, roof), at(-l * 0.6, -cab, roof)], top);
    const lamp = braking ? '#ff3b2f' : '#8d1d16';
    for (const k of [-1, 1]) area([at(-l, k * w * 0.95, 0.85), at(-l, k * w * 0.55, 0.85), at(-l, k * w * 0.55, 0.65), at(-l, k * w * 0.95, 0.65)], lamp, false);
  }

  function drawGap(ego, lead) {
    const f = ahead(lead.x, lead.y);
    if (f < 2) return;
    ctx.strokeStyle = colour.mark;
    ctx.lineWidth = 1.5;
    ctx.setLineDash([2, 5]);
    ctx.beginPath();
    ctx.moveTo(...pixel(ego.l / 2, aside(ego.x, ego.y)));
    ctx.lineTo(...pixel(f - lead.l / 2, aside(lead.x, lead.y)));
    ctx.stroke();
    ctx.setLineDash([]);
  }

  function drawLeadWords(lead, words) {
    const [f, r] = [ahead(lead.x, lead.y), aside(lead.x, lead.y)];
    if (f < 2) return;
    const top = view.flat;
    const [x, y] = top ? pixel(f, r + lead.w / 2 + 0.8) : pixel(f, r, 2.6);
    ctx.font = `600 13px ${colour.sans}`;
    const width = ctx.measureText(words).width + 14;
    const left = Math.min(Math.max(top ? x : x - width / 2, 4), view.right - width - 4);
    const middle = Math.min(Math.max(top ? y : y - 18, 14), view.height - 14);
    ctx.fillStyle = colour['label-back'];
    ctx.beginPath();
    ctx.roundRect(left, middle - 11, width, 22, 6);
    ctx.fill();
    write(words, left + width / 2, middle + 0.5, 13, colour['label-ink']);
  }

  /* The camera rides with the car, swings after it at a crossing and stays square to the road elsewhere. */
  function follow(ego, dt) {
    const soft = view.set ? 1 - Math.exp(-dt / 0.3) : 1;
    view.shift += (view.covered - view.shift) * soft;
    if (road.turns) {
      const turn = ego.h - view.h;
      view.h += (turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI))) * soft;
      view.x = ego.x;
      view.y = ego.y;
    } else {
      view.h = 0;
      view.x = ego.x;
      view.y += (ego.y - view.y) * soft;
    }
    view.cos = Math.cos(view.h);
    view.sin = Math.sin(view.h);
    view.set = true;
  }

  function drawAll(scene) {
    drawGround();
    fill(areas.verge, colour.verge);
    fill(areas.edge, colour['asphalt-edge']);
    fill(areas.asphalt, colour.asphalt);
    fill(areas.hatch, colour.hatch);
    fill(areas.solid, colour.mark);
    fill(areas.dashed, colour.mark);
    fill(areas.centre, colour.centre);
    fill(areas.stop, colour.mark);
    drawSky();
    if (scene.lead) drawGap(scene.ego, scene.lead);
    drawSigns();
    const bodies = [...scene.cars, ...road.obstacles.map(([x, y, h, l, w]) => ({ x, y, h, l, w, obstacle: true })), scene.ego];
    bodies.sort((a, b) => ahead(b.x, b.y) - ahead(a.x, a.y));
    for (const body of bodies) drawBody(body, body === scene.ego, body === scene.ego && scene.braking);
  }

  /* scene: {ego, cars, lead, leadWords, braking}, all at this instant; dt: seconds since the last picture. */
  function draw(scene, dt) {
    if (!road || !view.width) return;
    follow(scene.ego, dt);
    whole();
    drawAll(scene);
    if (scene.lead) drawLeadWords(scene.lead, scene.leadWords);
    if (view.mode === 'above') return;
    inset();
    ctx.save();
    ctx.beginPath();
    ctx.rect(view.left, 0, view.right - view.left, view.height);
    ctx.clip();
    drawAll(scene);
    ctx.fillStyle = colour['label-back'];
    ctx.fillRect(view.left, 0, 2, view.height);
    ctx.restore();
  }

  function toggle() {
    view.mode = view.mode === 'above' ? 'behind' : 'above';
    outline();
  }

  /* How many pixels on the left are under a card: the car keeps to the middle of the rest. */
  function cover(pixels) {
    view.covered = pixels;
  }

  return { resize, cover, setRoad, draw, toggle };
}
