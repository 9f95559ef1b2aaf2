/* The road from above, in metres; y grows to the right of +x, as on a canvas. The car stands near the middle. */

import { goalWords, kmh } from './words.js';

const LONGEST_GLIDE_MS = 300;
const JUMP_M = 30;
const SIGHT_M = 100;
const STRAIGHT_RAD = 0.05;
const LAMPS = { red: '#e5322b', yellow: '#f2b200', green: '#27a04a', off: '#8a8a8a' };
const NAMES = { car: 'A car', truck: 'A truck', bus: 'A bus', bicycle: 'A bicycle', motorcycle: 'A motorcycle', obstacle: 'An obstacle', static: 'An obstacle' };
const COLOURS = ['ground', 'tuft', 'verge', 'asphalt', 'asphalt-edge', 'mark', 'centre', 'hatch', 'car', 'car-edge', 'ego-fill', 'ego-edge',
  'ring', 'label-back', 'label-ink', 'brake', 'thing', 'thing-edge', 'sign', 'sign-ink', 'sans'];

const turned = (from, to) => to - from - 2 * Math.PI * Math.round((to - from) / (2 * Math.PI));

function pathOf(points) {
  const path = new Path2D();
  for (let i = 0; i < points.length; i += 2) path.lineTo(points[i], points[i + 1]);
  return path;
}

/* The box that a line of points is in: what is out of sight is not drawn. */
function boxOf(points) {
  const box = { x0: Infinity, y0: Infinity, x1: -Infinity, y1: -Infinity };
  for (let i = 0; i < points.length; i += 2) {
    box.x0 = Math.min(box.x0, points[i]);
    box.x1 = Math.max(box.x1, points[i]);
    box.y0 = Math.min(box.y0, points[i + 1]);
    box.y1 = Math.max(box.y1, points[i + 1]);
  }
  return box;
}

function directions(lane) {
  const found = [];
  for (let i = 0; i + 3 < lane.p.length; i += 2) found.push(Math.atan2(lane.p[i + 3] - lane.p[i + 1], lane.p[i + 2] - lane.p[i]));
  return found;
}

/* How far a point is from a lane's middle, how far the middle is to the right of it, and the lane's direction there. */
function beside(lane, x, y) {
  let best = { off: Infinity, right: 0, heading: 0 };
  for (let i = 0; i + 3 < lane.p.length; i += 2) {
    const [x0, y0, x1, y1] = [lane.p[i], lane.p[i + 1], lane.p[i + 2], lane.p[i + 3]];
    const [dx, dy] = [x1 - x0, y1 - y0];
    const share = Math.max(0, Math.min(1, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy || 1)));
    const [ox, oy] = [x0 + share * dx - x, y0 + share * dy - y];
    const off = Math.hypot(ox, oy);
    if (off < best.off) best = { off, right: (oy * dx - ox * dy) / (Math.hypot(dx, dy) || 1), heading: Math.atan2(dy, dx) };
  }
  return best;
}


export function makeScene(canvas) {
  const ctx = canvas.getContext('2d');
  const calm = matchMedia('(prefers-reduced-motion: reduce)');
  let colour = {};
  let size = { width: 0, height: 0, ratio: 1 };
  let road = null;
  let scene = null;
  let shown = new Map(); // what is on the screen now: id to {x, y, h}
  let from = new Map();
  let arrivedAt = 0;
  let glideMs = 100;
  let view = 0; // heading of the world that points ahead on the screen

  function resize() {
    const style = getComputedStyle(document.documentElement);
    colour = Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    size = { width: canvas.clientWidth, height: canvas.clientHeight, ratio: window.devicePixelRatio || 1 };
    canvas.width = Math.max(1, Math.round(size.width * size.ratio));
    canvas.height = Math.max(1, Math.round(size.height * size.ratio));
    if (scene) draw(performance.now());
  }

  function setRoad(told) {
    const headings = told.lanes.flatMap(directions);
    road = {
      lanes: told.lanes.map((lane) => ({ ...lane, path: pathOf(lane.p), box: boxOf(lane.p) })),
      surfaces: told.surfaces.map((surface) => ({ ...surface, path: pathOf(surface.p), box: boxOf(surface.p) })),
      lines: told.lines.map((line) => ({ ...line, path: pathOf(line.p), box: boxOf(line.p) })),
      bars: (told.bars || []).map((p) => ({ path: pathOf(p), box: boxOf(p) })),
      straight: headings.every((heading) => Math.abs(turned(headings[0], heading)) < STRAIGHT_RAD),
      tight: told.world === 'parking',
    };
    scene = null;
    shown = new Map();
  }

  const bodies = () => [scene.ego, ...scene.others];
  const keyOf = (body) => `${body.what} ${body.id}`; // things and cars are counted apart
  const placeOf = (body) => shown.get(keyOf(body));

  /* Roads come in the canvas's frame; bodies in the world's, whose y grows to the left. */
  const onCanvas = (body) => ({ ...body, y_m: -body.y_m, heading_rad: -body.heading_rad });

  function show(told) {
    const next = { ...told, ego: onCanvas(told.ego), others: told.others.map(onCanvas) };
    const now = performance.now();
    const jumped = !scene || next.time_s < scene.time_s || Math.hypot(next.ego.x_m - scene.ego.x_m, next.ego.y_m - scene.ego.y_m) > JUMP_M;
    glideMs = jumped ? 100 : Math.min(LONGEST_GLIDE_MS, glideMs * 0.8 + (now - arrivedAt) * 0.2);
    arrivedAt = now;
    from = jumped ? new Map() : new Map(shown);
    scene = next;
    if (jumped) view = next.ego.heading_rad;
    if (calm.matches) draw(now);
  }

  /* Where everything is between the last picture and the newest instant; calm: at that instant. */
  function glide(now) {
    const share = calm.matches ? 1 : Math.min(1, (now - arrivedAt) / glideMs);
    shown = new Map(bodies().map((body) => {
      const to = { x: body.x_m, y: body.y_m, h: body.heading_rad };
      const start = from.get(keyOf(body));
      if (!start || Math.hypot(to.x - start.x, to.y - start.y) > JUMP_M) return [keyOf(body), to];
      return [keyOf(body), {
        x: start.x + (to.x - start.x) * share, y: start.y + (to.y - start.y) * share, h: start.h + turned(start.h, to.h) * share,
      }];
    }));
  }

  function camera() {
    const ego = placeOf(scene.ego);
    const tall = size.height > size.width;
    const length = Math.max(size.width, size.height);
    const scale = road.tight ? Math.max(9, length / 48) : Math.max(5, length / 80);
    if (road.straight) view = directions(road.lanes[0])[0];
    else if (calm.matches) view = Math.round(ego.h / (Math.PI / 2)) * (Math.PI / 2);
    else view += turned(view, ahead(ego)) * 0.08;
    const spin = -view - (tall ? Math.PI / 2 : 0);
    // Somewhat behind the middle: what lies ahead matters more.
    const middle = tall ? [size.width / 2, size.height * 0.6] : [size.width * 0.42, size.height / 2];
    return { x: ego.x, y: ego.y, scale, cos: Math.cos(spin), sin: Math.sin(spin), middle };
  }

  const toScreen = (at, x, y) => [
    at.middle[0] + ((x - at.x) * at.cos - (y - at.y) * at.sin) * at.scale,
    at.middle[1] + ((x - at.x) * at.sin + (y - at.y) * at.cos) * at.scale,
  ];

  function enterWorld(at) {
    const k = at.scale * size.ratio;
    ctx.setTransform(k * at.cos, k * at.sin, -k * at.sin, k * at.cos, at.middle[0] * size.ratio, at.middle[1] * size.ratio);
    ctx.translate(-at.x, -at.y);
  }

  const enterScreen = () => ctx.setTransform(size.ratio, 0, 0, size.ratio, 0, 0);

  /* Tufts on a fixed grid of the world: beside an empty road they show the speed. */
  function drawGround(at) {
    enterScreen();
    ctx.fillStyle = colour.ground;
    ctx.fillRect(0, 0, size.width, size.height);
    enterWorld(at);
    ctx.fillStyle = colour.tuft;
    const reach = Math.hypot(size.width, size.height) / at.scale;
    const grid = road.tight ? 5 : 11;
    ctx.beginPath();
    for (let gx = Math.floor((at.x - reach) / grid); gx <= (at.x + reach) / grid; gx += 1) {
      for (let gy = Math.floor((at.y - reach) / grid); gy <= (at.y + reach) / grid; gy += 1) {
        const hash = Math.abs(Math.sin(gx * 127.1 + gy * 311.7) * 43758.5453) % 1;
        const [x, y] = [(gx + hash) * grid, (gy + ((hash * 7) % 1)) * grid];
        const radius = (0.4 + hash * 0.8) * (road.tight ? 0.5 : 1);
        ctx.moveTo(x + radius, y);
        ctx.arc(x, y, radius, 0, 7);
      }
    }
    ctx.fill();
  }

  function drawRoad(at) {
    const reach = Math.hypot(size.width, size.height) / at.scale;
    const inSight = ({ box }) => box.x0 < at.x + reach && box.x1 > at.x - reach && box.y0 < at.y + reach && box.y1 > at.y - reach;
    const surfaces = road.surfaces.filter(inSight);
    ctx.lineCap = road.straight ? 'butt' : 'round'; // no gaps where lanes meet at an angle
    ctx.lineJoin = 'round';
    for (const [extra, name] of [[3, 'verge'], [0.8, 'asphalt-edge'], [0.06, 'asphalt']]) {
      ctx.strokeStyle = colour[name];
      for (const surface of surfaces) {
        ctx.lineWidth = surface.w + (road.tight ? Math.min(extra, 1) : extra);
        ctx.stroke(surface.path);
      }
    }
    ctx.lineCap = 'butt';
    ctx.strokeStyle = colour.hatch;
    ctx.lineWidth = 0.16;
    for (const surface of surfaces) if (surface.e) hatch(surface, at);
    ctx.lineWidth = Math.max(0.16, 1.3 / at.scale);
    ctx.strokeStyle = colour.mark;
    ctx.lineWidth = 0.5;
    for (const bar of road.bars) if (inSight(bar)) ctx.stroke(bar.path);
    for (const line of road.lines.filter(inSight)) {
      ctx.strokeStyle = line.s === 'centre' ? colour.centre : colour.mark;
      ctx.setLineDash(line.s === 'dashed' ? [3, 6] : []);
      ctx.stroke(line.path);
    }
    ctx.setLineDash([]);
  }

  /* Diagonals across a lane that is not driven, near the car. */
  function hatch(surface, at) {
    const half = surface.w / 2;
    ctx.beginPath();
    for (let i = 0; i + 3 < surface.p.length; i += 2) {
      const [x0, y0, x1, y1] = surface.p.slice(i, i + 4);
      const length = Math.hypot(x1 - x0, y1 - y0);
      const [ux, uy] = [(x1 - x0) / length, (y1 - y0) / length];
      const here = (at.x - x0) * ux + (at.y - y0) * uy;
      const begin = Math.max(0, Math.ceil((here - SIGHT_M) / 5) * 5);
      for (let s = begin; s < Math.min(length - 1.5 * half, here + SIGHT_M); s += 5) {
        ctx.moveTo(x0 + ux * s + uy * half * 0.85, y0 + uy * s - ux * half * 0.85);
        ctx.lineTo(x0 + ux * (s + half * 1.5) - uy * half * 0.85, y0 + uy * (s + half * 1.5) + ux * half * 0.85);
      }
    }
    ctx.stroke();
  }

  const near = (x, y) => road.lanes.filter(({ box }) => box.x0 < x + 30 && box.x1 > x - 30 && box.y0 < y + 30 && box.y1 > y - 30);
  const laneOf = (x, y, h) => {
    const found = near(x, y).map((lane) => ({ lane, ...beside(lane, x, y) })).filter((one) => Math.cos(one.heading - h) > 0.5);
    found.sort((a, b) => a.off - b.off);
    return found.length && found[0].off < found[0].lane.w ? found[0].lane : null;
  };

  /* Where the road leads: a lane change does not turn the picture. */
  function ahead(ego) {
    const lane = laneOf(ego.x, ego.y, ego.h);
    return lane ? beside(lane, ego.x, ego.y).heading : ego.h;
  }

  /* The lane that is wished, while the car is not in it. */
  function drawGoal() {
    const goal = road.lanes.find((lane) => lane.id === scene.lane);
    const ego = placeOf(scene.ego);
    const lane = laneOf(ego.x, ego.y, ego.h);
    if (!goal || !lane || goal.id === lane.id) return;
    const { heading } = beside(goal, ego.x, ego.y);
    const [ux, uy] = [Math.cos(heading), Math.sin(heading)];
    const wash = ctx.createLinearGradient(ego.x, ego.y, ego.x + ux * 70, ego.y + uy * 70);
    wash.addColorStop(0, `${colour['ego-fill']}99`);
    wash.addColorStop(1, `${colour['ego-fill']}00`);
    ctx.save();
    ctx.beginPath();
    for (const [along, across] of [[0, -30], [70, -30], [70, 30], [0, 30]]) ctx.lineTo(ego.x + ux * along - uy * across, ego.y + uy * along + ux * across);
    ctx.clip();
    ctx.strokeStyle = wash;
    ctx.lineWidth = goal.w - 0.4;
    ctx.stroke(goal.path);
    ctx.restore();
  }

  /* Stop lines in the colour that their light shows. */
  function drawLights(at) {
    ctx.lineWidth = Math.max(0.6, 3 / at.scale);
    for (const light of scene.lights || []) {
      const [[ax, ay], [bx, by]] = light.stop_line_m;
      ctx.beginPath();
      ctx.moveTo(ax, -ay);
      ctx.lineTo(bx, -by);
      ctx.strokeStyle = LAMPS[light.state];
      ctx.stroke();
    }
  }

  function drawPerson(body) {
    const at = placeOf(body);
    ctx.beginPath();
    ctx.arc(at.x, at.y, 0.55, 0, 7);
    ctx.fillStyle = colour.thing;
    ctx.fill();
    ctx.lineWidth = 0.2;
    ctx.strokeStyle = colour['thing-edge'];
    ctx.stroke();
  }

  function drawBody(body, mine) {
    if (body.what === 'pedestrian') {
      drawPerson(body);
      return;
    }
    const at = placeOf(body);
    const [l, w] = [body.length_m, body.width_m];
    const thing = body.what === 'obstacle';
    ctx.save();
    ctx.translate(at.x, at.y);
    ctx.rotate(at.h);
    if (mine) {
      ctx.shadowColor = colour['ego-fill'];
      ctx.shadowBlur = 14 * size.ratio;
    }
    ctx.beginPath();
    ctx.roundRect(-l / 2, -w / 2, l, w, Math.min(w * 0.3, l * 0.2));
    ctx.fillStyle = mine ? colour['ego-fill'] : thing ? colour.thing : colour.car;
    ctx.fill();
    ctx.shadowBlur = 0;
    ctx.lineWidth = 0.2;
    ctx.strokeStyle = mine ? colour['ego-edge'] : thing ? colour['thing-edge'] : colour['car-edge'];
    ctx.stroke();
    if (!thing) {
      ctx.fillStyle = ctx.strokeStyle;
      ctx.globalAlpha = 0.62;
      ctx.beginPath();
      ctx.roundRect(l * 0.08, -w * 0.37, l * 0.17, w * 0.74, w * 0.1);
      ctx.roundRect(-l * 0.36, -w * 0.34, l * 0.09, w * 0.68, w * 0.08);
      ctx.fill();
      ctx.globalAlpha = 1;
    }
    if (mine && scene.acceleration_mps2 < -0.5) {
      ctx.fillStyle = colour.brake;
      ctx.fillRect(-l / 2 - 0.25, -w * 0.46, 0.6, w * 0.28);
      ctx.fillRect(-l / 2 - 0.25, w * 0.18, 0.6, w * 0.28);
    }
    if (mine && scene.shield) {
      ctx.beginPath();
      ctx.roundRect(-l / 2 - 1.3, -w / 2 - 0.9, l + 2.6, w + 1.8, 1.4);
      ctx.strokeStyle = colour.ring;
      ctx.lineWidth = 0.5;
      ctx.stroke();
    }
    ctx.restore();
  }

  function drawSign(sign, at) {
    const lanes = near(sign.x_m, sign.y_m).map((lane) => beside(lane, sign.x_m, sign.y_m)).sort((a, b) => a.off - b.off);
    const heading = lanes.length ? lanes[0].heading : sign.heading_rad;
    const [rx, ry] = [-Math.sin(heading), Math.cos(heading)];
    enterWorld(at);
    ctx.beginPath();
    ctx.moveTo(sign.x_m - rx * 1.8, sign.y_m - ry * 1.8);
    ctx.lineTo(sign.x_m + rx * 1.8, sign.y_m + ry * 1.8);
    ctx.strokeStyle = colour.mark;
    ctx.lineWidth = 0.5;
    ctx.stroke();
    enterScreen();
    const [x, y] = toScreen(at, sign.x_m + rx * 4.2, sign.y_m + ry * 4.2);
    const radius = Math.max(11, 1.7 * at.scale);
    ctx.beginPath();
    for (let k = 0; k < 8; k += 1) ctx.lineTo(x + radius * Math.cos(Math.PI / 8 + (k * Math.PI) / 4), y + radius * Math.sin(Math.PI / 8 + (k * Math.PI) / 4));
    ctx.closePath();
    ctx.fillStyle = colour.sign;
    ctx.fill();
    ctx.strokeStyle = colour['sign-ink'];
    ctx.lineWidth = 1.5;
    ctx.stroke();
    write('STOP', x, y + 0.5, radius * 0.62, colour['sign-ink'], 700);
  }

  function write(words, x, y, pixels, style, weight = 600, align = 'center') {
    ctx.font = `${weight} ${pixels}px ${colour.sans}`;
    ctx.textAlign = align;
    ctx.textBaseline = 'middle';
    ctx.fillStyle = style;
    ctx.fillText(words, x, y);
  }

  function label(words, x, y, back, ink) {
    ctx.font = `600 14px ${colour.sans}`;
    const width = ctx.measureText(words).width + 16;
    const left = Math.min(Math.max(x, 6), size.width - width - 6);
    const middle = Math.min(Math.max(y, 18), size.height - 18);
    ctx.fillStyle = back;
    ctx.beginPath();
    ctx.roundRect(left, middle - 13, width, 26, 7);
    ctx.fill();
    write(words, left + width / 2, middle + 0.5, 14, ink);
  }

  /* Another body as the car sees it: metres ahead and to the right, centre to centre. */
  function seen(body) {
    const [dx, dy] = [body.x_m - scene.ego.x_m, body.y_m - scene.ego.y_m];
    const h = scene.ego.heading_rad;
    return { body, ahead: dx * Math.cos(h) + dy * Math.sin(h), right: -dx * Math.sin(h) + dy * Math.cos(h) };
  }

  function lead() {
    const found = scene.others.filter((body) => body.what !== 'stop_sign' && body.what !== 'pedestrian').map(seen)
      .filter((one) => one.ahead > 0 && one.ahead < 120 && Math.abs(one.right) < 2.2);
    found.sort((a, b) => a.ahead - b.ahead);
    return found[0] || null;
  }

  /* The nearest stop line with a light that the car drives towards. */
  function lightAhead() {
    const found = (scene.lights || []).map((light) => {
      const [[ax, ay], [bx, by]] = light.stop_line_m;
      const { ahead, right } = seen({ x_m: (ax + bx) / 2, y_m: -(ay + by) / 2 });
      return { state: light.state, ahead: ahead - scene.ego.length_m / 2, right };
    }).filter((one) => one.ahead > -1 && one.ahead < 80 && Math.abs(one.right) < 2.2);
    found.sort((a, b) => a.ahead - b.ahead);
    return found[0] || null;
  }

  const gapTo = (one) => Math.max(0, one.ahead - (scene.ego.length_m + one.body.length_m) / 2);

  function drawLead(at) {
    const one = lead();
    if (!one) return null;
    const [ego, there] = [placeOf(scene.ego), placeOf(one.body)];
    ctx.beginPath();
    ctx.moveTo(ego.x + Math.cos(ego.h) * 2.5, ego.y + Math.sin(ego.h) * 2.5);
    ctx.lineTo(there.x - Math.cos(there.h) * 2.5, there.y - Math.sin(there.h) * 2.5);
    ctx.setLineDash([0.5, 1.2]);
    ctx.strokeStyle = colour.mark;
    ctx.lineWidth = 0.3;
    ctx.stroke();
    ctx.setLineDash([]);
    // Beside the road on its left, where it covers nobody.
    const lefts = near(there.x, there.y).map((lane) => beside(lane, there.x, there.y)).filter((lane) => lane.off < 25 && Math.cos(lane.heading - there.h) > 0.7);
    const left = Math.min(-2, ...lefts.map((lane) => lane.right - 2)) - 1.2;
    const [x, y] = toScreen(at, there.x - Math.sin(there.h) * left, there.y + Math.cos(there.h) * left);
    const metres = gapTo(one).toFixed(0);
    const words = one.body.what === 'obstacle' ? `${metres} m` : `${metres} m · ${kmh(one.body.speed_mps)} km/h`;
    return () => label(words, x - 30, y - 14, colour['label-back'], colour['label-ink']);
  }

  /* Where the car is going: a pin, or at the edge of the picture the direction of it. */
  function drawDestination(at) {
    const { goal } = scene;
    if (!goal) return;
    const [x, y] = toScreen(at, goal.x_m, -goal.y_m);
    const [px, py] = [Math.min(Math.max(x, 24), size.width - 24), Math.min(Math.max(y, 64), size.height - 72)];
    ctx.beginPath();
    ctx.arc(px, py, 8, 0, 7);
    ctx.fillStyle = colour['ego-fill'];
    ctx.fill();
    ctx.lineWidth = 3;
    ctx.strokeStyle = colour['label-back'];
    ctx.stroke();
    if (px === x && py === y) return;
    const turn = Math.atan2(y - py, x - px);
    ctx.beginPath();
    for (const [far, aside] of [[20, 0], [12, -0.6], [12, 0.6]]) ctx.lineTo(px + far * Math.cos(turn + aside), py + far * Math.sin(turn + aside));
    ctx.fillStyle = colour['label-back'];
    ctx.fill();
  }

  function draw(now) {
    if (!road || !scene || !size.width) return;
    glide(now);
    const at = camera();
    drawGround(at);
    drawRoad(at);
    drawLights(at);
    drawGoal();
    const nameLead = drawLead(at);
    for (const body of scene.others) if (body.what === 'stop_sign') drawSign(body, at);
    enterWorld(at);
    for (const body of scene.others) if (body.what !== 'stop_sign') drawBody(body, false);
    drawBody(scene.ego, true);
    enterScreen();
    if (nameLead) nameLead();
    drawDestination(at);
  }

  /* What is to be seen, in words. */
  function words() {
    if (!scene || !road) return '';
    const parts = [`At ${kmh(scene.ego.speed_mps)} km/h${scene.street ? ` on ${scene.street}` : ''}.`];
    if (scene.goal) parts.push(`${goalWords(scene.goal)}.`);
    const lane = laneOf(scene.ego.x_m, scene.ego.y_m, scene.ego.heading_rad);
    const abreast = lane && lane.road ? road.lanes.filter((other) => other.road === lane.road && (!other.e || lane.e)) : [];
    if (abreast.length > 1) {
      parts.push(`Lane ${lane.i + 1} of ${abreast.length} from the left.`);
    }
    const one = lead();
    if (!one) parts.push('Nobody close ahead.');
    else parts.push(`${NAMES[one.body.what] || 'Something'}${one.body.what === 'obstacle' || one.body.what === 'static' ? '' : ` doing ${kmh(one.body.speed_mps)} km/h`} ${gapTo(one).toFixed(0)} m ahead.`);
    const light = lightAhead();
    if (light) parts.push(`The light ${light.ahead.toFixed(0)} m ahead is ${light.state}.`);
    const person = scene.others.filter((body) => body.what === 'pedestrian').map(seen).filter((other) => other.ahead > 0 && other.ahead < 30 && Math.abs(other.right) < 5);
    if (person.length) parts.push('Somebody on foot ahead.');
    for (const [side, sign] of [['left', -1], ['right', 1]]) {
      const close = scene.others.filter((body) => body.what === 'car').map(seen)
        .filter((other) => other.right * sign > 2.2 && other.right * sign < 6 && Math.abs(other.ahead) < 40);
      close.sort((a, b) => Math.abs(a.ahead) - Math.abs(b.ahead));
      if (close.length) parts.push(`A car on the ${side}, ${where(close[0].ahead)}.`);
    }
    if (scene.others.some((body) => body.what === 'stop_sign' && seen(body).ahead > 0 && seen(body).ahead < 80 && Math.abs(seen(body).right) < 4)) parts.push('A stop sign ahead.');
    if (scene.shield) parts.push(`The shield acts: ${scene.shield}.`);
    return parts.join(' ');
  }

  const where = (ahead) => (Math.abs(ahead) < 5 ? 'beside you' : `${Math.abs(ahead).toFixed(0)} m ${ahead > 0 ? 'ahead' : 'behind'}`);

  function frame(now) {
    if (!calm.matches) draw(now);
    requestAnimationFrame(frame);
  }

  new ResizeObserver(resize).observe(canvas);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', resize);
  requestAnimationFrame(frame);
  return { setRoad, show, words };
}
