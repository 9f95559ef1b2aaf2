/* The one drawer of roads from above: trip page, cabin and notebook.

   Everything in metres; y grows to the right of +x, as on a canvas; headings in rad, clockwise. What is optional may be
   missing.
   road   {surfaces: [{p, w, k}], islands: [p], lines: [{p, s}], bars: {w, p: [p]}, signs: [{k, p, line, n}],
          names: [{n, x, y, h}]}, as `hmi/road.py` works it out: p is x, y, x, y …; k the kind of lane or sign; n words.
   scene  {ego, bodies: [body], lights: [{p, s}], places: [{n, x, y, to}], way: [p], plan: p, trail: p, wash: {p, w},
          ghost: {x, y, h, l, w, n}, goal: {n, x, y}, lead: {body, words}, shield: words, posts: y}
          `to` marks the destination among the places; `way` the lanes that lead there; `goal` is a destination that is
          no place, or far away; `ghost` where the car will stand; `wash` the lane it wants.
   body   {x, y, h, l, w, k, paint, crashed, braking, meant: words}; `meant` names the road user that the words meant.
   view   {x, y: what stands in the middle of the picture, scale: px a metre, turn: rad, middle: [px, px],
          box: [left, top, width, height], taken: [[left, top, right, bottom]]} in px; no words go where `taken` is. */

const SCENE_COLOURS = ['ground', 'ground-ink', 'tuft', 'verge', 'asphalt', 'asphalt-edge', 'mark', 'centre', 'hatch', 'car', 'car-edge',
  'ego-fill', 'ego-edge', 'ring', 'label-back', 'label-ink', 'thing', 'thing-edge', 'crash', 'way', 'sans'];
const LAMPS = { red: '#e5322b', yellow: '#f2b200', green: '#27a04a', off: '#8a8a8a' };
const [SIGN_RED, BRAKE, CONE, PERSON] = ['#b3201a', '#ff3b2f', '#e8641b', '#e08a1e'];
const LETTERS = 12.5;

export const turned = (from, to) => to - from - 2 * Math.PI * Math.round((to - from) / (2 * Math.PI));

function pathOf(p, closed) {
  const path = new Path2D();
  for (let i = 0; i < p.length; i += 2) path.lineTo(p[i], p[i + 1]);
  if (closed) path.closePath();
  return path;
}

/* A line with its path, and the box that it is in: what is out of sight is not drawn. */
function laid(p, more, closed = false) {
  const [xs, ys] = [p.filter((_, i) => i % 2 === 0), p.filter((_, i) => i % 2 === 1)];
  const box = { x0: Math.min(...xs), y0: Math.min(...ys), x1: Math.max(...xs), y1: Math.max(...ys) };
  return { ...more, p, box, path: pathOf(p, closed) };
}

export function layRoad(road) {
  return {
    surfaces: road.surfaces.map((one) => laid(one.p, one)),
    islands: road.islands.map((p) => laid(p, {}, true)),
    lines: road.lines.map((one) => laid(one.p, one)),
    bars: road.bars.p.map((p) => laid(p, { w: road.bars.w })),
    signs: road.signs,
    names: road.names,
  };
}

export function makeDrawer(canvas) {
  const ctx = canvas.getContext('2d');
  let colour = {};
  let ratio = 1;
  let view = null;
  let plates = []; // boxes of words that are written already

  /* Sizes in CSS pixels; colours as the style sheet has them now. */
  function resize(width, height) {
    const style = getComputedStyle(document.documentElement);
    colour = Object.fromEntries(SCENE_COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    ratio = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(width * ratio));
    canvas.height = Math.max(1, Math.round(height * ratio));
  }

  const toScreen = (x, y) => [
    view.middle[0] + ((x - view.x) * view.cos - (y - view.y) * view.sin) * view.scale,
    view.middle[1] + ((x - view.x) * view.sin + (y - view.y) * view.cos) * view.scale,
  ];
  const onScreen = () => ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  function inWorld() {
    const k = view.scale * ratio;
    ctx.setTransform(k * view.cos, k * view.sin, -k * view.sin, k * view.cos, view.middle[0] * ratio, view.middle[1] * ratio);
    ctx.translate(-view.x, -view.y);
  }
  const atLeast = (metres, pixels) => Math.max(metres, pixels / view.scale);
  const inSight = ({ box: { x0, y0, x1, y1 } }) => x0 < view.x + view.reach && x1 > view.x - view.reach && y0 < view.y + view.reach && y1 > view.y - view.reach;

  function stroke(what, width, style, dashes = []) {
    ctx.setLineDash(dashes);
    ctx.lineWidth = width;
    ctx.strokeStyle = style;
    if (what) ctx.stroke(what);
    else ctx.stroke();
  }

  /* Tufts on a fixed grid of the world: beside an empty road they show the speed. */
  function drawGround([x, y, width, height]) {
    onScreen();
    ctx.fillStyle = colour.ground;
    ctx.fillRect(x, y, width, height);
    if (view.scale < 3) return;
    inWorld();
    ctx.fillStyle = colour.tuft;
    const grid = view.scale > 12 ? 5 : 11;
    ctx.beginPath();
    for (let gx = Math.floor((view.x - view.reach) / grid); gx <= (view.x + view.reach) / grid; gx += 1) {
      for (let gy = Math.floor((view.y - view.reach) / grid); gy <= (view.y + view.reach) / grid; gy += 1) {
        const hash = Math.abs(Math.sin(gx * 127.1 + gy * 311.7) * 43758.5453) % 1;
        const [tx, ty, radius] = [(gx + hash) * grid, (gy + ((hash * 7) % 1)) * grid, 0.3 + hash * 0.06 * grid];
        ctx.moveTo(tx + radius, ty);
        ctx.arc(tx, ty, radius, 0, 7);
      }
    }
    ctx.fill();
  }

  function drawRoad(road) {
    const surfaces = road.surfaces.filter(inSight);
    [ctx.lineCap, ctx.lineJoin] = ['butt', 'round'];
    for (const [extra, name] of [[3, 'verge'], [0.8, 'asphalt-edge'], [0.06, 'asphalt']]) {
      for (const one of surfaces) stroke(one.path, one.w + (one.k === 'parking' || one.k === 'aisle' ? Math.min(extra, 1.2) : extra), colour[name]);
    }
    ctx.fillStyle = colour.asphalt;
    for (const one of road.islands.filter(inSight)) ctx.fill(one.path);
    for (const one of surfaces) if (one.k === 'emergency') hatch(one);
    for (const bar of road.bars.filter(inSight)) stroke(bar.path, bar.w, colour.mark);
    for (const one of road.lines.filter(inSight)) {
      stroke(one.path, atLeast(0.16, 1.2), one.s === 'centre' ? colour.centre : colour.mark, one.s === 'dashed' ? [3, 6] : []);
    }
    for (const sign of road.signs) if (sign.line) stroke(pathOf(sign.line), atLeast(0.5, 2), colour.mark, sign.k === 'yield' ? [0.6, 0.5] : []);
    ctx.setLineDash([]);
  }

  /* Diagonals across a lane that is not driven, tied to the world, so that they pass with the road. */
  function hatch({ p, w }) {
    const half = w / 2;
    ctx.beginPath();
    for (let i = 0; i + 3 < p.length; i += 2) {
      const [x0, y0, x1, y1] = p.slice(i, i + 4);
      const length = Math.hypot(x1 - x0, y1 - y0);
      const [ux, uy] = [(x1 - x0) / length, (y1 - y0) / length];
      const here = (view.x - x0) * ux + (view.y - y0) * uy;
      const begin = Math.max(0, Math.ceil((here - view.reach) / 5) * 5);
      for (let s = begin; s < Math.min(length - 1.5 * half, here + view.reach); s += 5) {
        ctx.moveTo(x0 + ux * s + uy * half * 0.85, y0 + uy * s - ux * half * 0.85);
        ctx.lineTo(x0 + ux * (s + half * 1.5) - uy * half * 0.85, y0 + uy * (s + half * 1.5) + ux * half * 0.85);
      }
    }
    stroke(null, atLeast(0.16, 1), colour.hatch);
  }

  /* The lane that is wanted, while the car is not in it, and the way to a destination. */
  function drawWishes({ ego, wash, way = [], plan, trail, ghost }) {
    if (wash) {
      const [ux, uy] = [Math.cos(ego.h), Math.sin(ego.h)];
      const fade = ctx.createLinearGradient(ego.x, ego.y, ego.x + ux * 70, ego.y + uy * 70);
      fade.addColorStop(0, `${colour['ego-fill']}88`);
      fade.addColorStop(1, `${colour['ego-fill']}00`);
      ctx.save();
      ctx.beginPath();
      for (const [along, across] of [[0, -30], [70, -30], [70, 30], [0, 30]]) ctx.lineTo(ego.x + ux * along - uy * across, ego.y + uy * along + ux * across);
      ctx.clip();
      stroke(pathOf(wash.p), wash.w - 0.4, fade);
      ctx.restore();
    }
    [ctx.lineCap, ctx.lineJoin] = ['round', 'round'];
    for (const p of way) stroke(pathOf(p), atLeast(1.1, 3), colour.way);
    if (trail) stroke(pathOf(trail), atLeast(0.4, 2), `${colour['ego-fill']}8c`);
    if (plan) stroke(pathOf(plan), atLeast(0.3, 2), colour['ego-fill'], [0.1, atLeast(0.9, 5)]);
    if (ghost) {
      outline(ghost, 0, 0);
      ctx.fillStyle = `${colour['ego-fill']}44`;
      ctx.fill();
      stroke(null, atLeast(0.18, 2), colour['ego-fill'], [0.7, 0.5]);
      ctx.restore();
    }
    ctx.setLineDash([]);
    ctx.lineCap = 'butt';
  }

  /* Stop lines in the colour that their light shows. */
  function drawLights(lights = []) {
    for (const light of lights) stroke(pathOf(light.p), atLeast(0.6, 3.5), LAMPS[light.s]);
  }

  /* The outline of a body, grown; the caller restores. */
  function outline({ x, y, h, l, w }, ahead, aside) {
    ctx.save();
    ctx.translate(x, y);
    ctx.rotate(h);
    ctx.beginPath();
    ctx.roundRect(-l / 2 - ahead, -w / 2 - aside, l + 2 * ahead, w + 2 * aside, Math.min(w * 0.3, l * 0.2) + ahead);
  }

  function disc({ x, y }, radius, fill) {
    ctx.beginPath();
    ctx.arc(x, y, radius, 0, 7);
    ctx.fillStyle = fill;
    ctx.fill();
  }

  function drawBody(body, mine, shield) {
    const { l, w } = body;
    if (body.k === 'static') {
      for (const [share, fill] of [[1, CONE], [0.62, '#ffffff'], [0.38, CONE]]) disc(body, atLeast(Math.max(l, w) / 2, 3) * share, fill);
    } else if (body.k === 'pedestrian') {
      disc(body, atLeast(0.62, 4.6), colour.mark); // dark clothes are seen at night, too
      disc(body, atLeast(0.5, 3.5), body.crashed ? colour.crash : body.paint || PERSON);
      stroke(null, atLeast(0.12, 1.25), colour['car-edge']);
    } else {
      const thing = body.k === 'obstacle';
      const edge = mine ? colour['ego-edge'] : thing ? colour['thing-edge'] : colour['car-edge'];
      outline(body, 0, 0);
      if (mine) [ctx.shadowColor, ctx.shadowBlur] = [colour['ego-fill'], 14 * ratio];
      ctx.fillStyle = body.crashed ? colour.crash : mine ? colour['ego-fill'] : thing ? colour.thing : body.paint || colour.car;
      ctx.fill();
      ctx.shadowBlur = 0;
      stroke(null, atLeast(0.14, 1.25), edge);
      if (!thing) drawGlass(body.k, l, w, edge);
      if (body.braking) {
        ctx.fillStyle = BRAKE;
        for (const side of [-0.46, 0.18]) ctx.fillRect(-l / 2 - 0.15, side * w, atLeast(0.4, 2.5), w * 0.28);
      }
      ctx.restore();
    }
    if (body.meant) ring(body, colour['label-ink'], colour['ego-fill']);
    if (mine && shield) ring(body, colour.ring);
  }

  /* Windscreen and rear window; of a bus or truck the cab; of a bicycle or motorcycle the rider. */
  function drawGlass(kind, l, w, edge) {
    ctx.fillStyle = edge;
    ctx.globalAlpha = 0.62;
    ctx.beginPath();
    if (kind === 'bicycle' || kind === 'motorcycle') ctx.arc(0, 0, w * 0.4, 0, 7);
    else if (kind === 'bus' || kind === 'truck') ctx.roundRect(l / 2 - 1.6, -w * 0.4, 0.6, w * 0.8, 0.2);
    else {
      ctx.roundRect(l * 0.08, -w * 0.37, l * 0.17, w * 0.74, w * 0.1);
      ctx.roundRect(-l * 0.36, -w * 0.34, l * 0.09, w * 0.68, w * 0.08);
    }
    ctx.fill();
    if (kind === 'truck') ctx.fillRect(l / 2 - 2.3, -w / 2, 0.15, w);
    ctx.globalAlpha = 1;
  }

  function ring(body, ...colours) {
    for (const [i, style] of colours.entries()) {
      outline(body, 1.1 - i * 0.35, 0.8 - i * 0.35);
      stroke(null, atLeast(0.35, 2.5), style);
      ctx.restore();
    }
  }

  function write(words, x, y, { size = LETTERS, weight = 500, fill = colour['ground-ink'], align = 'center', halo = '' } = {}) {
    ctx.font = `${weight} ${size}px ${colour.sans}`;
    ctx.textAlign = align;
    ctx.textBaseline = 'middle';
    if (halo) {
      ctx.lineJoin = 'round';
      [ctx.lineWidth, ctx.strokeStyle] = [3.5, halo];
      ctx.strokeText(words, x, y);
    }
    ctx.fillStyle = fill;
    ctx.fillText(words, x, y);
  }

  const free = (one) => plates.every((two) => one[0] > two[2] || one[2] < two[0] || one[1] > two[3] || one[3] < two[1]);

  /* Words on a plate beside a point: to its right, moved as far as it must to be seen whole and to cover no other. */
  function label(words, x, y, { back = 'label-back', ink = 'label-ink', edge = 6 } = {}) {
    ctx.font = `600 ${LETTERS}px ${colour.sans}`;
    const [bx, by, bw, bh] = view.box;
    const width = ctx.measureText(words).width + 16;
    const left = Math.min(Math.max(x, bx + edge), bx + bw - width - edge);
    const tries = [0, -26, 26, -52, 52].map((shift) => {
      const top = Math.min(Math.max(y + shift, by + 16), by + bh - 16) - 12;
      return [left, top, left + width, top + 24];
    });
    const plate = tries.find(free) || tries[0];
    plates.push(plate);
    ctx.fillStyle = colour[back];
    ctx.beginPath();
    ctx.roundRect(plate[0], plate[1], width, 24, 7);
    ctx.fill();
    write(words, plate[0] + width / 2, plate[1] + 12.5, { weight: 600, fill: colour[ink] });
  }

  function drawSign(sign) {
    const [x, y] = toScreen(...sign.p);
    const radius = Math.max(9, 1.5 * view.scale);
    const corners = { stop: 8, yield: 3 }[sign.k] || 32;
    const first = sign.k === 'yield' ? Math.PI / 2 : Math.PI / corners;
    ctx.beginPath();
    for (let k = 0; k < corners; k += 1) ctx.lineTo(x + radius * Math.cos(first + (k * 2 * Math.PI) / corners), y + radius * Math.sin(first + (k * 2 * Math.PI) / corners));
    ctx.closePath();
    ctx.fillStyle = sign.k === 'stop' ? SIGN_RED : '#ffffff';
    ctx.fill();
    stroke(null, Math.max(1.5, radius * 0.18), sign.k === 'stop' ? '#ffffff' : SIGN_RED);
    if (sign.n) write(sign.n, x, y + 0.5, { size: radius * (sign.k === 'stop' ? 0.62 : 0.95), weight: 700, fill: sign.k === 'stop' ? '#ffffff' : '#1c1f24' });
  }

  /* A street's name along it, never upside down; what drives there covers it. */
  function drawName({ n, x, y, h }) {
    const [px, py] = toScreen(x, y);
    ctx.font = `500 ${LETTERS}px ${colour.sans}`;
    const half = ctx.measureText(n).width / 2 + 6;
    const angle = turned(0, h + view.turn);
    const upright = Math.abs(angle) > Math.PI / 2 + 0.01 ? angle + Math.PI : angle;
    const [across, down] = [Math.abs(half * Math.cos(angle)) + 8, Math.abs(half * Math.sin(angle)) + 8];
    const plate = [px - across, py - down, px + across, py + down];
    const [bx, by, bw, bh] = view.box;
    if (!free(plate) || plate[2] < bx || plate[0] > bx + bw || plate[3] < by || plate[1] > by + bh) return;
    ctx.save();
    ctx.translate(px, py);
    ctx.rotate(upright);
    write(n, 0, 0, { fill: colour.mark, halo: colour.asphalt });
    ctx.restore();
  }

  /* A place with its name; the destination as a pin, or where it is out of sight an arrow at the edge towards it. */
  function drawPlace({ n, x, y, to }) {
    const [bx, by, bw, bh] = view.box;
    const [sx, sy] = toScreen(x, y);
    const [left, top, bottom] = n ? [22, 66, 60] : [10, 10, 10];
    const [px, py] = to ? [Math.min(Math.max(sx, bx + left), bx + bw - left), Math.min(Math.max(sy, by + top), by + bh - bottom)] : [sx, sy];
    const away = px !== sx || py !== sy;
    if (!to) {
      if (px < bx || px > bx + bw || py < by || py > by + bh) return;
      disc({ x: px, y: py }, 3.5, colour['ground-ink']);
      ctx.font = `500 ${LETTERS}px ${colour.sans}`;
      const plate = [px + 7, py - 9, px + 9 + ctx.measureText(n).width, py + 9];
      if (!free(plate)) return;
      plates.push(plate);
      write(n, px + 9, py, { align: 'left', halo: colour.ground });
      return;
    }
    if (away) {
      const turn = Math.atan2(sy - py, sx - px);
      ctx.beginPath();
      for (const [far, aside] of [[21, 0], [12, -0.6], [12, 0.6]]) ctx.lineTo(px + far * Math.cos(turn + aside), py + far * Math.sin(turn + aside));
      ctx.fillStyle = colour['label-back'];
      ctx.fill();
    }
    disc({ x: px, y: py }, 8, colour['ego-fill']);
    stroke(null, 3, colour['label-back']);
    if (!n) return;
    plates.push([px - 10, py - 10, px + 10, py + 10]);
    label(n, px + 14, py);
  }

  function drawLead({ ego, lead }) {
    const { body } = lead;
    ctx.beginPath();
    ctx.moveTo(ego.x + Math.cos(ego.h) * (ego.l / 2), ego.y + Math.sin(ego.h) * (ego.l / 2));
    ctx.lineTo(body.x - Math.cos(body.h) * (body.l / 2), body.y - Math.sin(body.h) * (body.l / 2));
    stroke(null, atLeast(0.2, 1.5), colour.mark, [0.5, 1.2]);
    ctx.setLineDash([]);
  }

  /* Distances along a road that is shown lengthwise. */
  function drawPosts(y) {
    const half = view.box[2] / 2 / view.scale;
    for (let x = Math.ceil((view.x - half) / 50) * 50; x < view.x + 2 * half; x += 50) {
      const [px, py] = toScreen(x, y);
      ctx.fillStyle = colour['ground-ink'];
      ctx.fillRect(px - 0.75, py, 1.5, 6);
      if (px > 30 && px < view.box[2] - 30) write(`${x} m`, px, py + 15, { size: 11.5 });
    }
  }

  /* One picture; `words` false for one so small that only roads, ways and the car are to be told. */
  function draw(road, scene, { x, y, scale, turn = 0, middle, box, taken = [] }, words = true) {
    view = { x, y, scale, turn, middle, box, cos: Math.cos(turn), sin: Math.sin(turn), reach: Math.hypot(box[2], box[3]) / scale };
    plates = [...taken];
    const { ego, bodies = [], places = [], goal, lead } = scene;
    onScreen();
    ctx.save();
    ctx.beginPath();
    ctx.rect(...box);
    ctx.clip();
    drawGround(box);
    inWorld();
    drawRoad(road);
    drawWishes(scene);
    drawLights(scene.lights);
    if (words) {
      for (const named of [ego, scene.ghost, lead && lead.body, ...bodies.filter((body) => body.meant)]) if (named) plates.push(boxOf(named));
      onScreen();
      for (const name of road.names) drawName(name);
      inWorld();
    }
    if (lead) drawLead(scene);
    if (words) for (const body of bodies) drawBody(body, false);
    drawBody(words ? ego : { ...ego, l: atLeast(ego.l, 13), w: atLeast(ego.w, 7) }, true, scene.shield);
    onScreen();
    if (scene.posts !== undefined) drawPosts(scene.posts);
    if (words) for (const sign of road.signs) drawSign(sign);
    const marked = goal ? [...places.filter((place) => !place.to), { ...goal, to: true }] : places;
    for (const place of marked) if (place.to) drawPlace(words ? place : { ...place, n: '' });
    if (words) {
      for (const body of bodies) if (body.meant) label(body.meant, ...beside(body));
      if (scene.ghost && scene.ghost.n) label(scene.ghost.n, ...beside(scene.ghost));
      if (lead && !lead.body.meant) label(lead.words, ...beside(lead.body));
      if (scene.shield) label(`Shield: ${scene.shield}`, box[0] + box[2], box[1] + box[3] - 22);
      for (const place of marked) if (!place.to) drawPlace(place);
    }
    ctx.restore();
    if (!words) {
      ctx.lineWidth = 2;
      ctx.strokeStyle = colour['label-back'];
      ctx.strokeRect(...box);
    }
  }

  /* The box round a body, and the point beyond its right side, as the picture shows it. */
  function boxOf({ x, y, h, l, w }) {
    const [px, py] = toScreen(x, y);
    const [c, s] = [Math.abs(Math.cos(h + view.turn)) / 2, Math.abs(Math.sin(h + view.turn)) / 2].map((half) => half * view.scale);
    return [px - c * l - s * w, py - s * l - c * w, px + c * l + s * w, py + s * l + c * w];
  }

  function beside(body) {
    const [, top, right, bottom] = boxOf(body);
    return [right + 10, (top + bottom) / 2];
  }

  /* How long a number of metres is, at the bottom left of the box. */
  function drawScale() {
    const metres = view.scale > 4 ? 10 : 20;
    const [x, y] = [view.box[0] + 14, view.box[1] + view.box[3] - 16];
    ctx.fillStyle = colour['ground-ink'];
    for (const [dx, dy, w, h] of [[0, 0, metres * view.scale, 2], [0, -4, 2, 6], [metres * view.scale - 2, -4, 2, 6]]) ctx.fillRect(x + dx, y + dy, w, h);
    write(`${metres} m`, x + (metres * view.scale) / 2, y - 9, { size: 11.5, halo: colour.ground });
  }

  return { resize, draw, drawScale };
}
