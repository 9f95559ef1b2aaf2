/* The road from above. World metres, y down the screen (to the right of +x), scaled by `view.scale` px/m. */
const CAPTION_PX = 66;
const POSTS_PX = 46;

function makeStage() {
  const canvas = $('road');
  const ctx = canvas.getContext('2d');
  const { road, camera } = drive;
  const [boxX0, boxY0, boxX1, boxY1] = camera.box;
  const byId = new Map();
  for (const car of drive.cars) byId.set(car.id, [...(byId.get(car.id) || []), car]);
  let colour = {};
  const view = { width: 0, height: 0, scale: 1, x: 0, y: 0 };

  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const sx = (x) => (x - view.x) * view.scale + view.width / 2;
  const sy = (y) => (y - view.y) * view.scale + view.height / 2;

  function resize() {
    const names = ['ground', 'ground-ink', 'verge', 'asphalt', 'asphalt-edge', 'mark', 'centre', 'hatch', 'car', 'car-edge',
      'ego-fill', 'ego-edge', 'label-back', 'label-ink', 'bad', 'ring', 'sans'];
    colour = Object.fromEntries(names.map((name) => [name, css(`--${name}`)]));
    view.width = canvas.parentElement.clientWidth;
    if (camera.along) {
      const metres = Math.min(170, Math.max(90, view.width / 7.5));
      view.scale = view.width / metres;
      // Room for the caption above the road and for the distance posts below it.
      view.height = (boxY1 - boxY0) * view.scale + CAPTION_PX + POSTS_PX;
      view.y = boxY0 + (view.height / 2 - CAPTION_PX) / view.scale;
    } else {
      view.height = Math.min(640, Math.max(360, view.width * 0.62));
      view.scale = Math.min(view.width / (boxX1 - boxX0), view.height / (boxY1 - boxY0));
      view.x = (boxX0 + boxX1) / 2;
      view.y = (boxY0 + boxY1) / 2;
    }
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(view.width * ratio);
    canvas.height = Math.round(view.height * ratio);
    canvas.style.height = `${view.height}px`;
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  function pose(body, at) {
    const local = Math.min(Math.max(at - body.first, 0), body.x.length - 1);
    const i = Math.floor(local);
    const j = Math.min(i + 1, body.x.length - 1);
    const f = local - i;
    let turn = body.h[j] - body.h[i];
    turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI));
    return {
      x: body.x[i] + (body.x[j] - body.x[i]) * f,
      y: body.y[i] + (body.y[j] - body.y[i]) * f,
      h: body.h[i] + turn * f,
      v: body.v ? body.v[i] : null,
      crashed: body.crashed !== null && body.crashed <= i,
    };
  }
  const present = (body, at) => at >= body.first - 0.001 && at <= body.first + body.x.length - 1 + 0.001;

  function trace(points) {
    ctx.beginPath();
    for (let i = 0; i < points.length; i += 2) ctx.lineTo(sx(points[i]), sy(points[i + 1]));
  }

  function drawSurfaces() {
    ctx.lineCap = 'butt';
    ctx.lineJoin = 'round';
    for (const [extra, name] of [[3, 'verge'], [0.8, 'asphalt-edge'], [0.06, 'asphalt']]) {
      ctx.strokeStyle = colour[name];
      for (const surface of road.surfaces) {
        trace(surface.p);
        ctx.lineWidth = (surface.w + extra) * view.scale;
        ctx.stroke();
      }
    }
    for (const surface of road.surfaces) if (surface.e) hatch(surface);
  }

  /* Diagonals tied to the world, so that they pass with the road. */
  function hatch(surface) {
    const half = surface.w / 2;
    ctx.save();
    ctx.strokeStyle = colour.hatch;
    ctx.lineWidth = Math.max(1, 0.18 * view.scale);
    for (let i = 0; i + 3 < surface.p.length; i += 2) {
      const [x0, y0, x1, y1] = surface.p.slice(i, i + 4);
      const length = Math.hypot(x1 - x0, y1 - y0);
      const ux = (x1 - x0) / length;
      const uy = (y1 - y0) / length;
      ctx.beginPath();
      for (let s = 0; s < length; s += 4) {
        const x = x0 + ux * s;
        const y = y0 + uy * s;
        if (Math.abs(sx(x) - view.width / 2) > view.width / 2 + 60) continue;
        ctx.moveTo(sx(x - uy * -half * 0.86), sy(y + ux * -half * 0.86));
        ctx.lineTo(sx(x + ux * half * 1.6 - uy * half * 0.86), sy(y + uy * half * 1.6 + ux * half * 0.86));
      }
      ctx.stroke();
    }
    ctx.restore();
  }

  function drawLines() {
    ctx.lineWidth = Math.max(1.2, 0.16 * view.scale);
    for (const line of road.lines) {
      ctx.strokeStyle = line.s === 'centre' ? colour.centre : colour.mark;
      ctx.setLineDash(line.s === 'dashed' ? [3 * view.scale, 6 * view.scale] : []);
      trace(line.p);
      ctx.stroke();
    }
    ctx.setLineDash([]);
    ctx.strokeStyle = colour.mark;
    ctx.lineWidth = Math.max(1.2, road.bars.w * view.scale);
    for (const bar of road.bars.p) {
      trace(bar);
      ctx.stroke();
    }
  }

  function drawCone(cone) {
    const radius = Math.max(3, Math.max(cone.l, cone.w) / 2 * view.scale);
    for (const [share, fill] of [[1, '#e8641b'], [0.62, '#ffffff'], [0.38, '#e8641b']]) {
      ctx.beginPath();
      ctx.arc(sx(cone.x), sy(cone.y), radius * share, 0, 2 * Math.PI);
      ctx.fillStyle = fill;
      ctx.fill();
    }
  }

  function drawSigns() {
    for (const sign of road.signs) {
      trace(sign.line);
      ctx.strokeStyle = colour.mark;
      ctx.lineWidth = Math.max(2, 0.5 * view.scale);
      ctx.stroke();
      const size = Math.max(11, 1.8 * view.scale);
      ctx.save();
      ctx.translate(sx(sign.post[0]) + size * 0.4, sy(sign.post[1]));
      ctx.beginPath();
      for (let k = 0; k < 8; k += 1) ctx.lineTo(size * Math.cos(Math.PI / 8 + k * Math.PI / 4), size * Math.sin(Math.PI / 8 + k * Math.PI / 4));
      ctx.closePath();
      ctx.fillStyle = '#b3201a';
      ctx.fill();
      ctx.strokeStyle = '#ffffff';
      ctx.lineWidth = 1.5;
      ctx.stroke();
      text('STOP', 0, 0.5, { size: size * 0.62, weight: 700, fill: '#ffffff' });
      ctx.restore();
    }
  }

  const LAMPS = { red: '#e5322b', yellow: '#f2b200', green: '#27a04a', off: '#8a8a8a' };

  /* Stop lines in the colour that their light shows. */
  function drawLights(index) {
    for (const light of drive.lights) {
      const now = light.s.findLast(([from]) => from <= index);
      if (!now) continue;
      trace(light.p);
      ctx.strokeStyle = LAMPS[now[1]];
      ctx.lineWidth = Math.max(3, 0.9 * view.scale);
      ctx.stroke();
    }
  }

  /* Where one may be taken to; the destination on a plate. */
  function drawPlaces() {
    for (const place of drive.places) {
      const x = sx(place.x);
      const y = sy(place.y);
      ctx.beginPath();
      ctx.arc(x, y, place.to ? 6 : 4, 0, 2 * Math.PI);
      ctx.fillStyle = place.to ? colour['ego-fill'] : colour['ground-ink'];
      ctx.fill();
      if (place.to) label(place.n, x + 11, y);
      else text(place.n, x + 9, y, { size: 11.5, align: 'left' });
    }
  }

  function drawPerson(body, at) {
    ctx.beginPath();
    ctx.arc(sx(at.x), sy(at.y), Math.max(3.5, body.w * 0.75 * view.scale), 0, 2 * Math.PI);
    ctx.fillStyle = at.crashed ? colour.bad : body.paint || '#e08a1e';
    ctx.fill();
    ctx.lineWidth = 1.25;
    ctx.strokeStyle = '#3d2a08';
    ctx.stroke();
  }

  function drawPosts() {
    if (!camera.along) return;
    const from = Math.ceil((view.x - view.width / 2 / view.scale) / 50) * 50;
    const y = sy(boxY1) + 1.5 * view.scale + 9;
    for (let x = from; sx(x) < view.width; x += 50) {
      ctx.fillStyle = colour['ground-ink'];
      ctx.fillRect(sx(x) - 0.75, y - 6, 1.5, 6);
      if (sx(x) > 30 && sx(x) < view.width - 30) text(`${x} m`, sx(x), y + 9, { size: 11.5, fill: colour['ground-ink'] });
    }
  }

  function text(words, x, y, { size = 12, weight = 400, fill = colour['ground-ink'], align = 'center' } = {}) {
    ctx.font = `${weight} ${size}px ${colour.sans}`;
    ctx.textAlign = align;
    ctx.textBaseline = 'middle';
    ctx.fillStyle = fill;
    ctx.fillText(words, x, y);
  }

  /* Words on a plate that begins at x, or as far left of it as it must to be seen whole. */
  function label(words, x, y) {
    ctx.font = `600 12px ${colour.sans}`;
    const width = ctx.measureText(words).width + 14;
    const left = Math.min(Math.max(x, 4), view.width - width - 4);
    ctx.fillStyle = colour['label-back'];
    ctx.beginPath();
    ctx.roundRect(left, y - 10, width, 20, 6);
    ctx.fill();
    text(words, left + width / 2, y + 0.5, { weight: 600, fill: colour['label-ink'] });
  }

  function drawBody(body, at, fill, edge, braking) {
    const l = body.l * view.scale;
    const w = body.w * view.scale;
    ctx.save();
    ctx.translate(sx(at.x), sy(at.y));
    ctx.rotate(at.h);
    ctx.beginPath();
    ctx.roundRect(-l / 2, -w / 2, l, w, Math.min(w * 0.3, l * 0.2));
    ctx.fillStyle = at.crashed ? colour.bad : fill;
    ctx.fill();
    ctx.lineWidth = 1.25;
    ctx.strokeStyle = edge;
    ctx.stroke();
    ctx.fillStyle = edge;
    ctx.globalAlpha = 0.62;
    ctx.beginPath();
    ctx.roundRect(l * 0.08, -w * 0.37, l * 0.17, w * 0.74, w * 0.1);
    ctx.roundRect(-l * 0.36, -w * 0.34, l * 0.09, w * 0.68, w * 0.08);
    ctx.fill();
    ctx.globalAlpha = 1;
    if (braking) {
      ctx.fillStyle = '#ff3b2f';
      ctx.fillRect(-l / 2 - 1, -w * 0.46, Math.max(2.5, l * 0.07), w * 0.28);
      ctx.fillRect(-l / 2 - 1, w * 0.18, Math.max(2.5, l * 0.07), w * 0.28);
    }
    ctx.restore();
  }

  function drawTrail(at) {
    ctx.beginPath();
    const last = Math.floor(at);
    for (let i = 0; i <= last; i += 1) ctx.lineTo(sx(drive.ego.x[i]), sy(drive.ego.y[i]));
    const now = pose(drive.ego, at);
    ctx.lineTo(sx(now.x), sy(now.y));
    ctx.strokeStyle = colour['ego-fill'];
    ctx.globalAlpha = 0.55;
    ctx.lineWidth = Math.max(2, 0.4 * view.scale);
    ctx.lineJoin = 'round';
    ctx.stroke();
    ctx.globalAlpha = 1;
  }

  /* The lane the program wants, while the ego is not in it yet. */
  function drawGoal(index, ego) {
    const goal = drive.goal[index];
    if (goal === null || !camera.along) return;
    const surface = road.surfaces[goal];
    const wash = ctx.createLinearGradient(sx(ego.x), 0, sx(ego.x + 70), 0);
    wash.addColorStop(0, `${colour['ego-fill']}88`);
    wash.addColorStop(1, `${colour['ego-fill']}00`);
    ctx.save();
    ctx.beginPath();
    ctx.rect(sx(ego.x), 0, 70 * view.scale, view.height);
    ctx.clip();
    trace(surface.p);
    ctx.strokeStyle = wash;
    ctx.lineWidth = (surface.w - 0.3) * view.scale;
    ctx.stroke();
    ctx.restore();
  }

  function drawLead(index, at, ego) {
    const lead = drive.lead[index];
    const car = lead === null ? null : (byId.get(lead) || []).find((body) => present(body, at));
    if (!car || drive.gap[index] > 130) return;
    const there = pose(car, at);
    ctx.strokeStyle = colour.mark;
    ctx.lineWidth = 1.5;
    ctx.setLineDash([2, 4]);
    ctx.beginPath();
    ctx.moveTo(sx(ego.x), sy(ego.y));
    ctx.lineTo(sx(there.x), sy(there.y));
    ctx.stroke();
    ctx.setLineDash([]);
    return () => {
      const words = `${drive.gap[index].toFixed(0)} m · ${pace(there.v)} ${trip.pace.unit}`;
      const front = sx(there.x) + (car.l / 2) * view.scale + 8;
      if (front < view.width) label(words, front, sy(there.y));
      else label(`${words} →`, view.width, sy(there.y));
    };
  }

  /* While the shield acts: a ring around the ego, and which rule, in words. */
  function drawShield(now, ego) {
    if (!now.length) return;
    const l = (drive.ego.l + 2.4) * view.scale;
    const w = (drive.ego.w + 1.6) * view.scale;
    ctx.save();
    ctx.translate(sx(ego.x), sy(ego.y));
    ctx.rotate(ego.h);
    ctx.beginPath();
    ctx.roundRect(-l / 2, -w / 2, l, w, w * 0.35);
    ctx.strokeStyle = colour.ring;
    ctx.lineWidth = Math.max(2.5, 0.3 * view.scale);
    ctx.stroke();
    ctx.restore();
    const names = [...new Set(now.map((s) => s.name))].join(', ');
    label(`Shield: ${names}`, view.width, camera.along ? 22 : view.height - 18);
  }

  function drawScale() {
    const metres = view.scale > 4 ? 10 : 20;
    const y = camera.along ? 28 : view.height - 16;
    ctx.fillStyle = colour['ground-ink'];
    ctx.fillRect(14, y, metres * view.scale, 2);
    ctx.fillRect(14, y - 4, 2, 6);
    ctx.fillRect(12 + metres * view.scale, y - 4, 2, 6);
    text(`${metres} m`, 14 + metres * view.scale / 2, y - 9, { size: 11.5 });
  }

  function draw(at) {
    const index = Math.min(Math.round(at), drive.time.length - 1);
    const ego = pose(drive.ego, at);
    if (camera.along) view.x = ego.x + (view.width / view.scale) * 0.16;
    ctx.fillStyle = colour.ground;
    ctx.fillRect(0, 0, view.width, view.height);
    drawSurfaces();
    drawPosts();
    drawGoal(index, ego);
    drawLines();
    drawTrail(at);
    drawSigns();
    drawLights(index);
    drawPlaces();
    const labelLead = drawLead(index, at, ego);
    for (const cone of drive.cones) drawCone(cone);
    for (const thing of drive.obstacles) drawBody(thing, { ...thing, crashed: false }, '#c9452f', '#3d0f08', false);
    for (const car of drive.cars) {
      if (!present(car, at)) continue;
      if (car.k === 'pedestrian') drawPerson(car, pose(car, at));
      else drawBody(car, pose(car, at), car.paint || colour.car, colour['car-edge'], false);
    }
    ctx.shadowColor = colour['ego-fill'];
    ctx.shadowBlur = 16;
    drawBody(drive.ego, ego, colour['ego-fill'], colour['ego-edge'], false);
    ctx.shadowBlur = 0;
    drawBody(drive.ego, ego, colour['ego-fill'], colour['ego-edge'], drive.acceleration[index] < -0.5);
    const shielded = shieldAt(drive.time[index]);
    drawShield(shielded, ego);
    if (labelLead) labelLead();
    drawScale();
    const state = ego.crashed ? 'crashed' : `at ${drive.speed[index].toFixed(1)} metres per second`;
    const guarded = shielded.length ? `, and the shield acts: ${shielded.map((s) => s.name).join(', ')}` : '';
    canvas.setAttribute('aria-label', `The road from above at ${drive.time[index].toFixed(1)} seconds: the car is ${state}${guarded}.`);
  }

  return { resize, draw };
}
