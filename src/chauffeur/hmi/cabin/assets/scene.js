/* What the session tells of the road as scenes of the drawer: gliding from instant to instant, the car near the middle.
   Roads come in the canvas's frame; bodies in the world's, whose y grows to the left. */

import { layRoad, makeDrawer, turned } from './drawer.js';
import { goalWords, pace } from './words.js';

const LONGEST_GLIDE_MS = 300;
const JUMP_M = 30;
const STRAIGHT_RAD = 0.05;
const NAMES = { car: 'A car', truck: 'A truck', bus: 'A bus', bicycle: 'A bicycle', motorcycle: 'A motorcycle', obstacle: 'An obstacle', static: 'An obstacle' };

function directions(lane) {
  const found = [];
  for (let i = 0; i + 3 < lane.p.length; i += 2) found.push(Math.atan2(lane.p[i + 3] - lane.p[i + 1], lane.p[i + 2] - lane.p[i]));
  return found;
}

/* How far a point is from a lane's middle, and the lane's direction there. */
function beside(lane, x, y) {
  let best = { off: Infinity, heading: 0 };
  for (let i = 0; i + 3 < lane.p.length; i += 2) {
    const [x0, y0, x1, y1] = lane.p.slice(i, i + 4);
    const [dx, dy] = [x1 - x0, y1 - y0];
    const share = Math.max(0, Math.min(1, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy || 1)));
    const off = Math.hypot(x0 + share * dx - x, y0 + share * dy - y);
    if (off < best.off) best = { off, heading: Math.atan2(dy, dx) };
  }
  return best;
}

/* A line from where a body is on it. */
function onward(p, { x, y }) {
  let [at, least, start] = [0, Infinity, [p[0], p[1]]];
  for (let i = 0; i + 3 < p.length; i += 2) {
    const [dx, dy] = [p[i + 2] - p[i], p[i + 3] - p[i + 1]];
    const share = Math.max(0, Math.min(1, ((x - p[i]) * dx + (y - p[i + 1]) * dy) / (dx * dx + dy * dy || 1)));
    const [nx, ny] = [p[i] + share * dx, p[i + 1] + share * dy];
    const off = Math.hypot(nx - x, ny - y);
    if (off < least) [at, least, start] = [i + 2, off, [nx, ny]];
  }
  return [...start, ...p.slice(at)];
}

export function makeScene(canvas) {
  const drawer = makeDrawer(canvas);
  const calm = matchMedia('(prefers-reduced-motion: reduce)');
  let size = { width: 0, height: 0 };
  let road = null;
  let scene = null;
  let shown = new Map(); // what is on the screen now: key to {x, y, h}
  let from = new Map();
  let arrivedAt = 0;
  let glideMs = 100;
  let view = 0; // heading of the world that points ahead on the screen

  function resize() {
    size = { width: canvas.clientWidth, height: canvas.clientHeight };
    drawer.resize(size.width, size.height);
    if (scene) draw(performance.now());
  }

  function setRoad(told) {
    const headings = told.lanes.flatMap(directions);
    road = {
      lanes: told.lanes,
      laid: layRoad(told),
      signs: told.signs,
      ways: new Map(told.lanes.map((lane) => [lane.id, lane.p])),
      straight: headings.every((heading) => Math.abs(turned(headings[0], heading)) < STRAIGHT_RAD),
      tight: told.world === 'parking',
    };
    scene = null;
    shown = new Map();
  }

  const keyOf = (body) => `${body.k} ${body.id}`; // things and cars are counted apart
  const onCanvas = (body) => ({
    id: body.id, k: body.what, x: body.x_m, y: -body.y_m, h: -body.heading_rad, l: body.length_m, w: body.width_m, v: body.speed_mps,
    paint: body.paint, meant: body.meant,
  });

  function show(told) {
    const next = {
      ...told, ego: { ...onCanvas(told.ego), k: 'car', id: 0, braking: told.acceleration_mps2 < -0.5 }, bodies: told.others.map(onCanvas),
      lights: told.lights.map(({ state, stop_line_m: [[ax, ay], [bx, by]] }) => ({ s: state, p: [ax, -ay, bx, -by] })),
    };
    const now = performance.now();
    const jumped = !scene || next.time_s < scene.time_s || Math.hypot(next.ego.x - scene.ego.x, next.ego.y - scene.ego.y) > JUMP_M;
    glideMs = jumped ? 100 : Math.min(LONGEST_GLIDE_MS, glideMs * 0.8 + (now - arrivedAt) * 0.2);
    arrivedAt = now;
    from = jumped ? new Map() : new Map(shown);
    scene = next;
    if (jumped) view = next.ego.h;
    if (calm.matches) draw(now);
  }

  /* Where a body is between the last picture and the newest instant; calm: at that instant. */
  function glided(body, share) {
    const start = from.get(keyOf(body));
    const at = !start || Math.hypot(body.x - start.x, body.y - start.y) > JUMP_M ? body : {
      ...body, x: start.x + (body.x - start.x) * share, y: start.y + (body.y - start.y) * share, h: start.h + turned(start.h, body.h) * share,
    };
    shown.set(keyOf(body), at);
    return at;
  }

  function camera(ego) {
    const { width, height } = size;
    const tall = height > width;
    const length = Math.max(width, height);
    if (road.straight) [view] = directions(road.lanes[0]);
    else if (calm.matches) view = Math.round(ego.h / (Math.PI / 2)) * (Math.PI / 2);
    else view += turned(view, ahead(ego)) * 0.08;
    return {
      x: ego.x, y: ego.y, scale: road.tight ? Math.max(9, length / 48) : Math.max(4, length / 88), turn: -view - (tall ? Math.PI / 2 : 0),
      // Somewhat behind the middle: what lies ahead matters more.
      middle: tall ? [width / 2, height * 0.6] : [width * 0.42, height / 2], box: [0, 0, width, height],
      taken: [[0, 0, width, 42]], // what the car does is told there
    };
  }

  const laneOf = (x, y, h) => {
    const found = road.lanes.map((lane) => ({ lane, ...beside(lane, x, y) })).filter((one) => one.off < one.lane.w && Math.cos(one.heading - h) > 0.5);
    return found.length ? found.reduce((a, b) => (a.off <= b.off ? a : b)).lane : null;
  };

  /* Where the road leads: a lane change does not turn the picture. */
  function ahead(ego) {
    const lane = laneOf(ego.x, ego.y, ego.h);
    return lane ? beside(lane, ego.x, ego.y).heading : ego.h;
  }

  /* Another body as the car sees it: metres ahead and to the right, centre to centre. */
  function seen(body) {
    const { x, y, h } = scene.ego;
    const [dx, dy] = [body.x - x, body.y - y];
    return { body, ahead: dx * Math.cos(h) + dy * Math.sin(h), right: dy * Math.cos(h) - dx * Math.sin(h) };
  }
  const nearest = (bodies, far, wide) => bodies.map(seen).filter((one) => one.ahead > 0 && one.ahead < far && Math.abs(one.right) < wide)
    .reduce((a, b) => (a && a.ahead <= b.ahead ? a : b), null);
  const middleOf = (line) => ({ x: (line[0] + line[2]) / 2, y: (line[1] + line[3]) / 2 });

  const lead = () => nearest(scene.bodies.filter((body) => body.k !== 'pedestrian'), 120, 2.2);
  const gapTo = (one) => Math.max(0, one.ahead - (scene.ego.l + one.body.l) / 2).toFixed(0);
  const stands = (body) => body.k === 'obstacle' || body.k === 'static';

  function draw(now) {
    if (!road || !scene || !size.width) return;
    const share = calm.matches ? 1 : Math.min(1, (now - arrivedAt) / glideMs);
    shown = new Map();
    const ego = glided(scene.ego, share);
    const bodies = scene.bodies.map((body) => glided(body, share));
    const one = lead();
    const wanted = road.lanes.find((lane) => lane.id === scene.lane);
    const { goal } = scene;
    drawer.draw(road.laid, {
      ego, bodies, lights: scene.lights, shield: scene.shield,
      lead: one && { body: shown.get(keyOf(one.body)), words: stands(one.body) ? `${gapTo(one)} m` : `${gapTo(one)} m · ${pace(one.body.v)}` },
      wash: wanted && wanted !== laneOf(ego.x, ego.y, ego.h) ? wanted : null,
      goal: goal && { n: goal.name, x: goal.x_m, y: -goal.y_m },
      way: goal ? goal.lanes.map((id, i) => road.ways.get(id) && (i ? road.ways.get(id) : onward(road.ways.get(id), ego))).filter(Boolean) : [],
    }, camera(ego));
  }

  /* What is to be seen, in words. */
  function words() {
    if (!scene || !road) return '';
    const { ego } = scene;
    const parts = [`At ${pace(ego.v)}${scene.street ? ` on ${scene.street}` : ''}.`];
    if (scene.goal) parts.push(`${goalWords(scene.goal)}.`);
    const lane = laneOf(ego.x, ego.y, ego.h);
    const abreast = lane && lane.road ? road.lanes.filter((other) => other.road === lane.road && (!other.e || lane.e)) : [];
    if (abreast.length > 1) parts.push(`Lane ${lane.i + 1} of ${abreast.length} from the left.`);
    const one = lead();
    parts.push(one ? `${NAMES[one.body.k] || 'Something'}${stands(one.body) ? '' : ` doing ${pace(one.body.v)}`} ${gapTo(one)} m ahead.` : 'Nobody close ahead.');
    const light = nearest(scene.lights.map((each) => ({ ...each, ...middleOf(each.p) })), 80, 2.2);
    if (light) parts.push(`The light ${Math.max(0, light.ahead - ego.l / 2).toFixed(0)} m ahead is ${light.body.s}.`);
    if (nearest(scene.bodies.filter((body) => body.k === 'pedestrian'), 30, 5)) parts.push('Somebody on foot ahead.');
    for (const [side, sign] of [['left', -1], ['right', 1]]) {
      const close = scene.bodies.filter((body) => body.k === 'car').map(seen).filter((other) => other.right * sign > 2.2 && other.right * sign < 6 && Math.abs(other.ahead) < 40);
      close.sort((a, b) => Math.abs(a.ahead) - Math.abs(b.ahead));
      if (close.length) parts.push(`A car on the ${side}, ${where(close[0].ahead)}.`);
    }
    if (nearest(road.signs.filter((sign) => sign.k === 'stop' && sign.line).map((sign) => middleOf(sign.line)), 80, 4)) parts.push('A stop sign ahead.');
    if (scene.shield) parts.push(`The shield acts: ${scene.shield}.`);
    return parts.join(' ');
  }

  const where = (metres) => (Math.abs(metres) < 5 ? 'beside you' : `${Math.abs(metres).toFixed(0)} m ${metres > 0 ? 'ahead' : 'behind'}`);

  function frame(now) {
    if (!calm.matches) draw(now);
    requestAnimationFrame(frame);
  }

  new ResizeObserver(resize).observe(canvas);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', resize);
  requestAnimationFrame(frame);
  return { setRoad, show, words };
}
