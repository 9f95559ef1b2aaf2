/* The recorded drive as scenes of the drawer: which bodies stand where at an instant, and from where it is looked at. */
const POSTS_PX = 40;
const CAPTION_PX = 66;
const FOLLOWED_PX = 4; // a way that would be drawn smaller is followed, with the whole of it in a corner

function makeStage() {
  const canvas = $('road');
  const drawer = makeDrawer(canvas);
  const road = layRoad(drive.road);
  const { along, box: [x0, y0, x1, y1] } = drive.camera;
  const meant = drive.meant || {}; // id of a road user or thing to the words that meant it
  const things = [...drive.obstacles.map((one) => ({ ...one, k: 'obstacle', meant: meant[one.id] })), ...drive.cones.map((one) => ({ ...one, k: 'static' }))];
  let size = { width: 0, height: 0, scale: 1 };
  let whole = true;

  function resize() {
    const width = canvas.parentElement.clientWidth;
    if (along) {
      const scale = width / Math.min(170, Math.max(90, width / 7.5));
      size = { width, scale, height: (y1 - y0) * scale + CAPTION_PX + POSTS_PX };
    } else {
      // On a small screen, or in a notebook's frame, time line and instruments stay in sight below it.
      const height = Math.min(640, Math.max(300, Math.min(width * 0.62, window.innerHeight * 0.5)));
      const fits = Math.min(width / (x1 - x0), height / (y1 - y0));
      whole = fits >= FOLLOWED_PX;
      size = { width, height, scale: whole ? fits : Math.max(FOLLOWED_PX, width / 110) };
    }
    canvas.style.height = `${size.height}px`;
    drawer.resize(size.width, size.height);
  }

  function pose(body, at) {
    const local = Math.min(Math.max(at - body.first, 0), body.x.length - 1);
    const i = Math.floor(local);
    const j = Math.min(i + 1, body.x.length - 1);
    const f = local - i;
    return {
      id: body.id, k: body.k, l: body.l, w: body.w, paint: body.paint,
      x: body.x[i] + (body.x[j] - body.x[i]) * f,
      y: body.y[i] + (body.y[j] - body.y[i]) * f,
      h: body.h[i] + turned(body.h[i], body.h[j]) * f,
      v: body.v ? body.v[i] : null,
      crashed: body.crashed !== null && body.crashed <= i,
      meant: meant[body.id],
    };
  }
  const present = (body, at) => at >= body.first - 0.001 && at <= body.first + body.x.length - 1 + 0.001;

  function trail(at, ego) {
    const points = [];
    for (let i = 0; i <= Math.floor(at); i += 1) points.push(drive.ego.x[i], drive.ego.y[i]);
    return [...points, ego.x, ego.y];
  }

  function leader(bodies, index) {
    const body = drive.lead[index] === null ? null : bodies.find((one) => one.id === drive.lead[index]);
    if (!body || drive.gap[index] > 130) return null;
    return { body, words: `${drive.gap[index].toFixed(0)} m · ${pace(body.v)} ${trip.pace.unit}` };
  }

  function draw(at) {
    const index = Math.min(Math.round(at), drive.time.length - 1);
    const ego = { ...pose(drive.ego, at), braking: drive.acceleration[index] < -0.5 };
    const bodies = [...things, ...drive.cars.filter((car) => present(car, at)).map((car) => pose(car, at))];
    const shield = [...new Set(shieldAt(drive.time[index]).map((one) => one.name))].join(', ');
    const wanted = drive.goal[index];
    const scene = {
      ego, bodies, shield, lead: leader(bodies, index), places: drive.places, way: drive.way, ghost: drive.ghost, trail: trail(at, ego),
      wash: wanted === null || !along ? null : drive.road.surfaces[wanted],
      lights: drive.lights.map((light) => ({ p: light.p, s: (light.s.findLast(([from]) => from <= index) || [])[1] })).filter((light) => light.s),
      posts: along ? y1 + 1.8 : undefined,
    };
    const { width, height, scale } = size;
    const [middleX, middleY] = [(x0 + x1) / 2, (y0 + y1) / 2];
    const follows = !along && !whole;
    const [w, h] = [Math.min(200, width * 0.34), Math.min(150, height * 0.34)];
    const corner = [width - w - 8, 8, w, h];
    drawer.draw(road, scene, {
      x: along || follows ? ego.x : middleX, y: along ? y0 : follows ? ego.y : middleY, scale,
      middle: along ? [width * 0.34, CAPTION_PX] : [width / 2, height / 2],
      box: [0, 0, width, height], taken: follows ? [[corner[0], 0, width, h + 12]] : [],
    });
    if (!along) drawer.drawScale();
    if (follows) {
      const small = Math.min(w / (x1 - x0), h / (y1 - y0));
      drawer.draw(road, scene, { x: middleX, y: middleY, scale: small, middle: [corner[0] + w / 2, 8 + h / 2], box: corner }, false);
    }
    const state = ego.crashed ? 'crashed' : `at ${pace(drive.speed[index])} ${trip.pace.unit}`;
    canvas.setAttribute('aria-label', `The road from above at ${drive.time[index].toFixed(1)} seconds: the car is ${state}${shield ? `, and the shield acts: ${shield}` : ''}.`);
  }

  return { resize, draw };
}
